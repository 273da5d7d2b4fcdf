/** What the phase of a motion does as time goes by. */
export type Nature = "vibration" | "displacement" | "sequence";

const PERIOD = 2; // s, of a cycle at speed 1
const STEPS = 24; // of a cycle

/** The place within a cycle, 0 to 1, which runs while played. Of a sequence a cycle goes through all poses once. */
export class Player {
  playing = false;
  loop = true;
  speed = 1;
  place = 0;
  private last: number | null = null;
  private poses = 0;
  private nature: Nature = "vibration";

  /** Take up a motion; `poses` of a sequence. */
  start(nature: Nature, poses: number): void {
    if (nature !== this.nature || poses !== this.poses) this.place = nature === "vibration" ? 0.25 : nature === "displacement" ? 0.5 : 0;
    this.nature = nature;
    this.poses = poses;
    this.last = null;
  }

  /** Go on to a time, ms; whether another frame is due. */
  tick(now: number): boolean {
    if (!this.playing) {
      this.last = null;
      return false;
    }
    const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, 0.1);
    this.last = now;
    const period = this.nature === "sequence" ? PERIOD * Math.max(1, (this.poses - 1) / 4) : PERIOD;
    this.place += (passed * this.speed) / period;
    if (this.place >= 1) {
      this.place = this.loop ? this.place % 1 : 1;
      this.playing = this.loop;
    }
    return this.playing;
  }

  toggle(): void {
    if (!this.playing && this.place >= 1) this.place = 0;
    this.playing = !this.playing;
    this.last = null;
  }

  step(by: 1 | -1): void {
    this.playing = false;
    if (this.nature === "sequence") {
      const all = Math.max(this.poses - 1, 1);
      this.place = Math.min(Math.max(Math.round(this.place * all) + by, 0), all) / all;
    } else {
      this.place = (((Math.round(this.place * STEPS) + by) / STEPS) + 1) % 1;
    }
  }

  /** How much of the displacement is shown, -1 to 1. */
  get amount(): number {
    const turn = 2 * Math.PI * this.place;
    return this.nature === "vibration" ? Math.sin(turn) : this.nature === "displacement" ? 0.5 - 0.5 * Math.cos(turn) : 1;
  }

  /** The pose nearest to the place. */
  get pose(): number {
    return Math.round(this.place * Math.max(this.poses - 1, 0));
  }

  /** The two poses shown of a sequence, and how far from the first to the second. */
  get between(): [number, number, number] {
    const at = this.place * (this.poses - 1);
    const first = Math.min(Math.floor(at), Math.max(this.poses - 2, 0));
    return [first, Math.min(first + 1, this.poses - 1), at - first];
  }
}
