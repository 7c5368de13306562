// SPDX-License-Identifier: Apache-2.0
// The address of the present view, kept in the browser's bar.
import type { Look } from './look'
import { toHash } from './settings'
import type { Cameras } from './three/cameras'
import type { Stage } from './three/stage'

const REST = 300 // ms without a change before the address is written: browsers refuse many writes

export function keepLink(stage: Stage, cameras: Cameras, look: Look): void {
  let timer = 0
  const write = () => {
    const { camera } = stage
    camera.updateMatrixWorld()
    const eye = {
      pose: camera.matrixWorld.toArray(),
      target: cameras.orbit.target.toArray() as [number, number, number],
      verticalFov: stage.fieldOfView,
    }
    history.replaceState(null, '', toHash(look.settings.value, look.meteredExposure, eye))
  }
  const later = () => {
    window.clearTimeout(timer)
    timer = window.setTimeout(write, REST)
  }
  stage.afterDrawing.push(later) // whatever changes the view is drawn
  look.settings.watch(later)
}
