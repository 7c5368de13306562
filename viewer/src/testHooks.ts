// SPDX-License-Identifier: Apache-2.0
// `window.deltalux`: what tests and measurements ask of a running page.
import { Vector3 } from 'three'
import type { App } from './app'

export interface TestHooks {
  state(): object
  probe(x: number, y: number): object | null
  project(name: string): [x: number, y: number] | null
  place(point: [number, number, number]): [x: number, y: number]
  gizmoHandle(axis: 'X' | 'Y' | 'Z'): [x: number, y: number] | null
  gizmoAxis(): string | null
  idle(): boolean
  still(): boolean
  cost(): object
  frames: number[]
  latencies: number[]
}

declare global {
  interface Window {
    deltalux: TestHooks
  }
}

// long: a list of hooks, each of a few lines.
export function testHooks(app: App): TestHooks {
  const { stage, lit, objects, remote, look, cameras } = app
  const onPage = (point: Vector3): [number, number] => {
    const { left, top, width, height } = stage.canvas.getBoundingClientRect()
    const at = point.clone().project(stage.camera)
    return [left + ((at.x + 1) / 2) * width, top + ((1 - at.y) / 2) * height]
  }
  return {
    state: () => ({
      link: remote.link.value,
      geometry: lit.info.geometry,
      server: remote.state.value,
      frame: remote.frame.value,
      unreached: remote.unreached.value,
      checked: remote.checked.value,
      exported: remote.exported.value,
      selected: objects.selected.value,
      settings: look.settings.value,
      scale: look.scale.value,
      exposure: look.exposure,
      isolineLabels: app.labels.shown,
      known: lit.values.known,
      preview: lit.values.preview,
      poses: Object.fromEntries(
        lit.movables.map((body) => [body.name, body.visible ? body.matrix.toArray() : null]),
      ),
      camera: {
        pose: stage.camera.matrixWorld.toArray(),
        fov: stage.camera.fov,
        target: cameras.orbit.target.toArray(),
      },
      canvas: stage.canvas.getBoundingClientRect().toJSON() as object,
    }),
    /** At canvas pixels: the value, where it is, and between which vertices. */
    probe: (x, y) => {
      const hit = app.pointer.at(x, y)
      return (
        hit && {
          name: hit.body.name,
          point: hit.point.toArray(),
          vertices: hit.vertices,
          weights: hit.weights,
          sampled: hit.sampled,
          reading: app.probes.read(hit),
        }
      )
    },
    project: (name) => {
      const body = lit.body(name)
      if (!body) return null
      body.geometry.computeBoundingSphere()
      return onPage(body.localToWorld(body.geometry.boundingSphere!.center.clone()))
    },
    /** Where a point of the world is on the page. */
    place: (point) => onPage(new Vector3(...point)),
    gizmoHandle: (axis) => (objects.gizmo.body === null ? null : onPage(objects.gizmo.arrow(axis))),
    gizmoAxis: () => objects.gizmo.controls.axis,
    /** Nothing to draw. */
    still: () => stage.idle && look.metering === 0 && lit.factors.complete,
    /** Nothing to draw, nothing on the way, the light up to date. */
    idle: () =>
      stage.idle &&
      look.metering === 0 &&
      lit.factors.complete &&
      !remote.busyDragging &&
      remote.state.value?.phase === 'ready' &&
      app.flow.shown === remote.state.value.revision,
    /** What drawing took and takes of the graphics card: pictures, programs, calls for one, bytes a vertex. */
    cost: () => {
      const { info } = stage.renderer
      info.autoReset = false
      info.reset()
      stage.drawNow()
      const { calls } = info.render
      info.autoReset = true
      const bytes = lit.bodies.reduce((sum, { geometry }) => {
        const arrays = [...Object.values(geometry.attributes), geometry.index!].map(({ array }) => array)
        return sum + arrays.reduce((total, { byteLength }) => total + byteLength, 0)
      }, 0)
      return {
        pictures: stage.pictures,
        programs: info.programs!.map(({ name }) => name),
        calls,
        bytesOfVertex: bytes / lit.info.vertices,
      }
    },
    frames: app.flow.frames,
    latencies: app.latency.all,
  }
}
