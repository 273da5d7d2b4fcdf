import { h, icon } from "./dom";
import type { Commands } from "./state";

/** Buttons over the picture. */
export class Toolbar {
  readonly element: HTMLElement;
  private readonly pressed: [HTMLButtonElement, () => boolean][] = [];
  private readonly model: HTMLButtonElement;

  constructor(private readonly commands: Commands) {
    const button = (label: string, act: () => void, drawing: string[], on?: () => boolean) => {
      const own = h("button", { type: "button", class: "fx-button", "aria-label": label, title: label, click: act }, icon(...drawing));
      if (on) this.pressed.push([own, on]);
      return own;
    };
    const state = () => commands.state;
    this.model = button("save as GLB for Blender and slides", () => commands.saveModel(), ["M12 2l9 5v10l-9 5-9-5V7z", "M3 7l9 5 9-5M12 12v10"]);
    this.element = h(
      "div",
      { class: "fx-toolbar", role: "toolbar", "aria-label": "view" },
      button("show all (f)", () => commands.fit(), ["M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5"]),
      button("isometric (0)", () => commands.look("iso"), ["M12 3l8 4.5v9L12 21l-8-4.5v-9z", "M4 7.5l8 4.5 8-4.5M12 12v9"]),
      button("parallel projection (o)", () => commands.set({ parallel: !state().parallel }), ["M4 8l5-4h11v11l-5 5H4zM4 8h11v12M15 8l5-4"], () => state().parallel),
      button("see through bodies (t)", () => commands.set({ seeThrough: !state().seeThrough }), ["M2 12s4-7 10-7 10 7 10 7-4 7-10 7S2 12 2 12z", "M12 9a3 3 0 1 0 0 6 3 3 0 0 0 0-6"], () => state().seeThrough),
      button("undeformed outline (g)", () => commands.set({ ghost: !state().ghost }), ["M4 18c3-12 7 2 10-6s4-6 6-6", "M4 20h16"], () => state().ghost),
      button("save as PNG", () => commands.savePicture(), ["M4 5h16v14H4zM4 16l5-5 4 4 3-3 4 4M15.5 9.5h.01"]),
      this.model,
      button("full screen", () => commands.toggleFull(), ["M3 3h7M3 3v7M3 3l7 7M21 21h-7M21 21v-7M21 21l-7-7"]),
      button("keys (?)", () => commands.toggleHelp(), ["M9 9a3 3 0 1 1 4 2.8c-.8.3-1 1-1 2.2M12 18h.01"]),
      h("button", { type: "button", class: "fx-button fx-more", "aria-label": "controls", title: "controls", click: () => commands.togglePanel() }, icon("M4 7h10M18 7h2M4 17h2M10 17h10M16 5v4M8 15v4")),
    );
  }

  update(): void {
    for (const [button, on] of this.pressed) button.ariaPressed = String(on());
    this.model.disabled = this.commands.scene.parts.length === 0;
  }
}
