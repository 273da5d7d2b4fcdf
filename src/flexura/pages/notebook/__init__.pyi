from flexura.pages.notebook.sliders import sliders as sliders
