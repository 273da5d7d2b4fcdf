import { type OrthographicCamera, type PerspectiveCamera, Vector3 } from "three";
import type { Triple } from "../scene";

export const VIEWS: Record<string, { label: string; key: string; from: Triple }> = {
  iso: { label: "isometric", key: "0", from: [1, -1, 0.8165] },
  front: { label: "front", key: "1", from: [0, -1, 0] },
  back: { label: "back", key: "2", from: [0, 1, 0] },
  left: { label: "left", key: "3", from: [-1, 0, 0] },
  right: { label: "right", key: "4", from: [1, 0, 0] },
  top: { label: "top", key: "5", from: [0, -1e-4, 1] },
  bottom: { label: "bottom", key: "6", from: [0, -1e-4, -1] },
};

const LOOKED_AT = 4000; // points, when it is found what fits

/** Distance from which, seen from `direction`, all points (n, 3) around `target` are in the picture. */
export function fittingDistance(camera: PerspectiveCamera, direction: Vector3, points: Float32Array, target: Vector3): number {
  const back = direction.clone().normalize();
  const right = new Vector3(0, 0, 1).cross(back).normalize();
  const up = back.clone().cross(right);
  const slopeY = Math.tan((camera.fov * Math.PI) / 360);
  const slopeX = slopeY * camera.aspect;
  const every = 3 * Math.max(1, Math.floor(points.length / 3 / LOOKED_AT));
  const p = new Vector3();
  let distance = 1e-3;
  for (let k = 0; k + 2 < points.length; k += every) {
    p.fromArray(points, k).sub(target);
    const depth = p.dot(back);
    distance = Math.max(distance, depth + Math.abs(p.dot(right)) / slopeX, depth + Math.abs(p.dot(up)) / slopeY);
  }
  return 1.14 * distance;
}

/** Make a parallel projection show at its target what a perspective shows there. */
export function alike(flat: OrthographicCamera, deep: PerspectiveCamera, target: Vector3): void {
  const half = deep.position.distanceTo(target) * Math.tan((deep.fov * Math.PI) / 360);
  flat.position.copy(deep.position);
  flat.quaternion.copy(deep.quaternion);
  flat.zoom = 1 / half;
  flat.left = -deep.aspect;
  flat.right = deep.aspect;
  flat.top = 1;
  flat.bottom = -1;
  flat.updateProjectionMatrix();
}

/** Put a perspective where it shows at the target what a parallel projection shows. */
export function alikeDeep(deep: PerspectiveCamera, flat: OrthographicCamera, target: Vector3): void {
  const distance = 1 / flat.zoom / Math.tan((deep.fov * Math.PI) / 360);
  const away = flat.position.clone().sub(target).normalize();
  deep.position.copy(target).addScaledVector(away, distance);
  deep.quaternion.copy(flat.quaternion);
}
