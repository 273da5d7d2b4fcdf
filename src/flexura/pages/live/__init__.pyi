from flexura.pages.live.serving import live as live
