// Where one looks from: about a point that stays in the middle, at a map from above.

import { OrthographicCamera, PerspectiveCamera, Vector3 } from "three";

const FIELD_OF_VIEW = 30;
const NEAREST = 1e-9;
const FARTHEST = 20;

/** The camera. Lengths are in the picture's frame. */
export class Camera {
  readonly target = new Vector3();
  distance = 3;
  /** Angles about the axis that points upwards, and above the plane across it. */
  yaw = 0.9;
  pitch = 0.4;
  private readonly perspective = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
  private readonly orthographic = new OrthographicCamera(-1, 1, 1, -1, -10, 10);
  private height = 1;

  constructor(
    readonly isMap: boolean,
    public up: number,
  ) {}

  get three(): PerspectiveCamera | OrthographicCamera {
    return this.isMap ? this.orthographic : this.perspective;
  }

  /** Lengths of the frame that a pixel has at the target. */
  get pixel(): number {
    return (2 * this.distance * Math.tan((FIELD_OF_VIEW * Math.PI) / 360)) / this.height;
  }

  /** From the target to the eye. */
  direction(): Vector3 {
    if (this.isMap) return new Vector3(0, 0, 1);
    const flat = Math.cos(this.pitch);
    const direction = new Vector3();
    direction.setComponent((this.up + 1) % 3, flat * Math.cos(this.yaw));
    direction.setComponent((this.up + 2) % 3, flat * Math.sin(this.yaw));
    direction.setComponent(this.up, Math.sin(this.pitch));
    return direction;
  }

  /** Puts all of three's camera up to date. */
  update(width: number, height: number): void {
    this.height = height;
    const aspect = width / height;
    const up = new Vector3().setComponent(this.isMap ? 1 : this.up, 1);
    const camera = this.three;
    camera.up.copy(up);
    camera.position.copy(this.target).addScaledVector(this.direction(), this.distance);
    camera.lookAt(this.target);
    if (camera instanceof PerspectiveCamera) {
      camera.aspect = aspect;
      camera.near = this.distance * 0.02;
      camera.far = Math.min(this.distance + 4, this.distance * 4e4);
    } else {
      const half = (this.pixel * height) / 2;
      camera.left = -half * aspect;
      camera.right = half * aspect;
      camera.top = half;
      camera.bottom = -half;
      camera.near = -10;
      camera.far = this.distance + 10;
    }
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  turn(dx: number, dy: number): void {
    this.yaw -= dx;
    this.pitch = Math.min(Math.PI / 2 - 1e-3, Math.max(-Math.PI / 2 + 1e-3, this.pitch + dy));
  }

  /** Moves the picture by so many pixels to the right and down. */
  pan(dx: number, dy: number): void {
    const right = new Vector3().setFromMatrixColumn(this.three.matrixWorld, 0);
    const upward = new Vector3().setFromMatrixColumn(this.three.matrixWorld, 1);
    this.target.addScaledVector(right, -dx * this.pixel).addScaledVector(upward, dy * this.pixel);
  }

  /** Brings the target nearer, for a factor below 1; the place `x`, `y` pixels from the middle stays there. */
  zoom(factor: number, x = 0, y = 0): void {
    const before = this.distance;
    this.distance = Math.min(FARTHEST, Math.max(NEAREST, before * factor));
    const moved = 1 - this.distance / before;
    const size = this.pixel * (before / this.distance);
    const right = new Vector3().setFromMatrixColumn(this.three.matrixWorld, 0);
    const upward = new Vector3().setFromMatrixColumn(this.three.matrixWorld, 1);
    this.target.addScaledVector(right, x * size * moved).addScaledVector(upward, -y * size * moved);
  }

  /** Shows all of a box of these extents about the frame's origin. */
  fit(extents: readonly number[], width: number, height: number): void {
    this.target.set(0, 0, 0);
    const tangent = Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
    if (this.isMap) {
      this.distance = (0.54 / tangent) * Math.max(extents[1], (extents[0] * height) / width);
    } else {
      const radius = Math.hypot(extents[0], extents[1], extents[2]) / 2;
      this.distance = (radius * 1.02) / (Math.sin((FIELD_OF_VIEW * Math.PI) / 360) * Math.min(1, width / height));
    }
    this.distance = Math.min(FARTHEST, Math.max(NEAREST, this.distance));
  }
}
