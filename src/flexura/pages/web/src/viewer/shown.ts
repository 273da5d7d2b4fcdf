import type { Fact, Motion, Quantity } from "../scene";
import type { Model } from "./model";
import { valueText } from "./overlays";
import { scaleText } from "./playbar";
import type { Player } from "./player";
import { KINDS, type State, largestOf, motionsOf, sequenceOf } from "./state";

/** What is seen now, in words and numbers. */
export class Shown {
  reach = 0; // largest displacement at factor 1, sizes of the frame

  constructor(
    public model: Model,
    private readonly state: Readonly<State>,
    private readonly player: Player,
  ) {}

  /** One motion, the poses of a sequence, or none. */
  get motions(): Motion[] {
    return motionsOf(this.model.scene, this.state.shown);
  }

  /** Of the poses of a sequence the nearest; else the first, the only one. */
  get pose(): number {
    return sequenceOf(this.model.scene, this.state.shown) ? this.player.pose : 0;
  }

  /** Quantity that colours, with the largest value of all poses of a sequence. */
  get quantity(): Quantity | null {
    if (this.state.colour === KINDS) return null;
    const known = this.motions.flatMap((motion) =>
      motion.colours
        .filter((colour) => colour.key === this.state.colour)
        .map((colour) => ({ ...colour, largest: largestOf(motion, colour) })),
    );
    if (known.length === 0) return null;
    const largest = known.map((colour) => colour.largest).filter((value): value is number => value !== null);
    return { ...known[0], largest: largest.length ? Math.max(...largest) : null };
  }

  /** What makes shares of a motion's largest value shares of the largest of all poses. */
  weight(own: Motion): number {
    const common = this.quantity?.largest;
    const colour = own.colours.find((one) => one.key === this.state.colour);
    const largest = colour && largestOf(own, colour);
    return common && typeof largest === "number" ? largest / common : 1;
  }

  get heading(): { title: string; subtitle: string } {
    const own = sequenceOf(this.model.scene, this.state.shown) ?? this.model.motions.get(this.state.shown ?? "");
    return { title: own?.title ?? (this.model.scene.motions.length ? "undeformed" : ""), subtitle: own && "subtitle" in own ? own.subtitle : "" };
  }

  get scale(): string {
    return scaleText(this.motions[0], this.state.factor, this.reach);
  }

  /** All of it, to be read out. */
  get sentence(): string {
    const { title, subtitle } = this.heading;
    const { motions, quantity } = this;
    const playing = motions.length > 0 && (this.player.playing ? "playing" : "paused");
    const warnings = [...new Set(motions.flatMap((own) => own.warnings))];
    const colours = quantity && `coloured by ${quantity.label}`;
    return [title, subtitle, motions[0]?.flag, this.scale, colours, playing, ...warnings].filter(Boolean).join(", ");
  }

  /** What a part reaches of each quantity. */
  async values(number: number): Promise<Fact[]> {
    const part = this.model.scene.parts[number];
    const motion = this.motions[this.pose];
    if (!part || !motion) return [];
    const own = motion.colours.map(async (colour): Promise<Fact> => {
      const share = await this.model.reached(motion, colour, part);
      const known = { ...colour, largest: largestOf(motion, colour) };
      return [colour.label, share === null ? "unknown" : `up to ${valueText(known, share)}`];
    });
    const told = (motion.by_part ?? []).map((one): Fact => [one.label, one.values[number] ?? ""]);
    return [...told.filter(([, text]) => text !== ""), ...(await Promise.all(own))];
  }
}
