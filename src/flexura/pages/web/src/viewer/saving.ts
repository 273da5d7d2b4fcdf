import { glb } from "./glb";
import type { Labels } from "./labels";
import { barTicks, barTitle } from "./overlays";
import { download, fileName, pictureOf } from "./save";
import type { Shown } from "./shown";
import type { Stage } from "./stage";
import type { State } from "./state";
import type { Theme } from "./theme";

/** Save what is seen as a PNG with its caption. */
export function savePicture(stage: Stage, shown: Shown, labels: Labels["texts"], theme: Theme): void {
  const { quantity } = shown;
  const { title, subtitle } = shown.heading;
  const { name } = shown.model.scene;
  const caption = {
    title: name,
    lines: [title, subtitle, shown.scale].filter(Boolean),
    labels,
    bar: quantity ? { title: barTitle(quantity), ticks: barTicks(quantity) } : null,
    camera: stage.view,
    background: theme.background,
    ink: theme.ink,
  };
  const out = stage.drawnFine((canvas) => pictureOf(canvas, stage.host.clientWidth, caption));
  out.toBlob((blob) => blob && download(blob, `${fileName(name, title)}.png`), "image/png");
}

/** Save the parts that are shown, with the motion as large as it is drawn, as a GLB. */
export async function saveModel(shown: Shown, state: Readonly<State>): Promise<void> {
  const { model, motions } = shown;
  const { size } = model.frame;
  const shapes = await Promise.all(
    motions.map(async (own) => {
      const { displacement } = await model.field(own, null);
      return { name: own.title, displacement: displacement.map((d) => d * size * own.factor * state.factor) };
    }),
  );
  const parts = model.scene.parts.map((_, k) => k).filter((k) => !state.hidden.has(model.scene.parts[k].kind));
  const { title } = shown.heading;
  download(glb(model, parts, shapes, motions, title), `${fileName(model.scene.name, title)}.glb`);
}
