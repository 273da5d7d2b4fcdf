import { number } from "../numbers";
import { h, icon, unique } from "./dom";
import type { Player } from "./player";
import { type Commands, motionsOf, sequenceOf } from "./state";

const PLAY = "M7 4.5v15l12-7.5z";
const PAUSE = "M8 5v14M16 5v14";
const BACK = "M18 5v14l-9-7zM6 5v14";
const ON = "M6 5v14l9-7zM18 5v14";
const LOOP = "M17 2l4 4-4 4M3 11V9a3 3 0 0 1 3-3h15M7 22l-4-4 4-4M21 13v2a3 3 0 0 1-3 3H3";
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

/** Play, step, loop; the place within the motion; how quick, and how large. */
export class PlayBar {
  readonly element: HTMLElement;
  private readonly play: HTMLButtonElement;
  private readonly loop: HTMLButtonElement;
  private readonly place: HTMLInputElement;
  private readonly placeText = h("output", { class: "fx-place" });
  private readonly factor: HTMLInputElement;
  private readonly factorText = h("output", { class: "fx-factor" });
  private readonly truth: HTMLButtonElement;

  constructor(
    private readonly commands: Commands,
    private readonly player: Player,
    changed: () => void,
    private readonly scaled: () => string,
  ) {
    const button = (label: string, act: () => void, ...drawing: string[]) =>
      h("button", { type: "button", class: "fx-button", "aria-label": label, title: label, click: () => { act(); changed(); } }, icon(...drawing));
    this.play = button("play", () => player.toggle(), PLAY);
    this.loop = button("loop", () => { player.loop = !player.loop; }, LOOP);
    const slide = (value: number) => { player.playing = false; player.place = value; changed(); };
    this.place = h("input", { type: "range", min: 0, max: 1, step: 0.001, "aria-label": "place within the motion", input: () => slide(Number(this.place.value)) });
    const scale = () => commands.set({ factor: 10 ** Number(this.factor.value) });
    this.factor = h("input", { type: "range", min: -2, max: 2, step: 0.01, "aria-label": "scale of the displacement", input: scale });
    this.truth = h("button", { type: "button", class: "fx-button fx-text", title: "true scale", "aria-label": "1:1, true scale", click: () => this.trueScale() }, "1:1");
    const speed = h(
      "select",
      { class: "fx-select", "aria-label": "speed", change: () => { player.speed = Number(speed.value); } },
      ...SPEEDS.map((own) => h("option", { value: own, selected: own === 1 }, `${own}×`)),
    );
    const id = unique("factor");
    this.factor.id = id;
    this.element = h(
      "div",
      { class: "fx-bar", role: "group", "aria-label": "motion" },
      h("div", { class: "fx-play" }, button("step back", () => player.step(-1), BACK), this.play, button("step on", () => player.step(1), ON), this.loop),
      h("div", { class: "fx-slide" }, this.place, this.placeText),
      h("div", { class: "fx-slide fx-scale" }, h("label", { for: id }, "scale"), this.factor, this.truth, this.factorText),
      speed,
    );
  }

  /** Show what is played now. */
  update(): void {
    const { state, scene } = this.commands;
    const motions = motionsOf(scene, state.shown);
    const still = motions.length === 0;
    this.element.classList.toggle("fx-still", still);
    for (const control of this.element.querySelectorAll<HTMLButtonElement>("button, input, select")) control.disabled = still;
    this.play.replaceChildren(icon(this.player.playing ? PAUSE : PLAY));
    this.play.ariaLabel = this.play.title = this.player.playing ? "pause" : "play";
    this.loop.ariaPressed = String(this.player.loop);
    this.factor.min = String(Math.min(-2, ...motions.map((own) => -Math.log10(Math.max(own.factor, 1e-12)))));
    this.factor.value = String(Math.log10(state.factor));
    this.truth.hidden = motions[0]?.nature !== "displacement";
    this.truth.ariaPressed = String(motions.length > 0 && Math.abs(motions[0].factor * state.factor - 1) < 1e-9);
    this.factorText.textContent = this.scaled();
    this.factor.setAttribute("aria-valuetext", this.factorText.textContent);
    this.follow();
  }

  /** Show the place alone: quick, for every frame. */
  follow(): void {
    this.place.value = String(this.player.place);
    this.placeText.textContent = this.placed();
    this.place.setAttribute("aria-valuetext", this.placeText.textContent);
  }

  private trueScale(): void {
    const motion = motionsOf(this.commands.scene, this.commands.state.shown)[0];
    if (motion) this.commands.set({ factor: 1 / motion.factor });
  }

  private placed(): string {
    const { scene, state } = this.commands;
    const sequence = sequenceOf(scene, state.shown);
    if (!sequence) return `${Math.round(100 * this.player.amount)} %`;
    const [first, second, share] = this.player.between;
    const value = sequence.values[first] + share * (sequence.values[second] - sequence.values[first]);
    return `${number(value, 3)} ${sequence.unit}`;
  }
}

/** How the displacement is scaled, in words; of modes, whose size is free, how far they are drawn. `reach`: largest
 * displacement at factor 1, in sizes of the mechanism. */
export function scaleText(motion: { factor: number; nature: string } | undefined, factor: number, reach: number): string {
  if (!motion) return "";
  const all = motion.factor * factor;
  if (motion.nature === "vibration") return `± ${number(100 * all * reach, 3)} % of size`;
  return Math.abs(all - 1) < 1e-9 ? "true scale" : `× ${number(all, 3)}`;
}
