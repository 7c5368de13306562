// SPDX-License-Identifier: Apache-2.0
// Messages between page and server, as python/deltalux/server declares them.
// Made by tools/make_protocol.py: change the declarations there.

export interface MoveRequest {
  type: 'move'
  name: string
  pose: number[]
  dragging?: boolean
}

export interface RemoveRequest {
  type: 'remove'
  name: string
}

export interface AddRequest {
  type: 'add'
  name: string
}

export interface DimRequest {
  type: 'dim'
  group: string
  factor: number
  dragging?: boolean
}

export interface ReflectanceRequest {
  type: 'reflectance'
  material: string
  value: [number, number, number]
  dragging?: boolean
}

export interface DimsRequest {
  type: 'dims'
  factors: Record<string, number>
  dragging?: boolean
}

export interface EditRequest {
  type: 'edit'
  edits: SingleEdit[]
}

export interface UndoRequest {
  type: 'undo'
}

export interface RedoRequest {
  type: 'redo'
}

export interface BakeRequest {
  type: 'bake'
}

export interface MakeMovableRequest {
  type: 'make_movable'
  mesh: string
}

export interface AddLampRequest {
  type: 'add_lamp'
  position: [number, number, number]
}

export interface CheckRequest {
  type: 'check'
}

export interface CancelRequest {
  type: 'cancel'
}

export interface BudgetRequest {
  type: 'budget'
  milliseconds: number | null
}

export interface ExportRequest {
  type: 'export'
  file: string
}

export interface FinishRequest {
  type: 'finish'
  digest?: boolean
}

export interface ReadRequest {
  type: 'read'
  arrays: string[]
}

export type SingleEdit = MoveRequest | RemoveRequest | AddRequest | DimRequest | ReflectanceRequest

export type RequestMessage =
  | SingleEdit
  | DimsRequest
  | EditRequest
  | UndoRequest
  | RedoRequest
  | BakeRequest
  | MakeMovableRequest
  | AddLampRequest
  | CheckRequest
  | CancelRequest
  | BudgetRequest
  | ExportRequest
  | FinishRequest
  | ReadRequest

export interface StateMessage {
  type: 'state'
  revision: number
  poses: Record<string, number[] | null>
  factors: Record<string, number>
  reflectances: Record<string, [number, number, number]>
  dark: boolean
  undo: string | null
  redo: string | null
  phase: 'empty' | 'baking' | 'preview' | 'ready' | 'updating' | 'checking' | 'failed'
  budget: number | null
}

export interface ProgressMessage {
  type: 'progress'
  task: 'bake' | 'check' | 'export' | 'read'
  stage: string
  fraction: number
  eta: number | null
}

export interface FrameMessage {
  type: 'frame'
  revision: number
  milliseconds: Record<string, number>
  affected_paths: number
  paths: number
  retraced_segments: number
  segments: number
  gathered_rays: number
  changed_rays: number
  done: number
  static_method: string | null
  moving_method: string | null
  recompute_milliseconds: number | null
  speed_up: number | null
  latency: number | null
}

export interface GeometryMessage {
  type: 'geometry'
  number: number
}

export interface UnreachedMessage {
  type: 'unreached'
  revision: number
  samples: number
}

export interface CheckedMessage {
  type: 'checked'
  same: boolean
  digest: string
  recomputed: string
  milliseconds: number
}

export interface CancelledMessage {
  type: 'cancelled'
  task: string
}

export interface NoticeMessage {
  type: 'notice'
  message: string
}

export interface AcceptedMessage {
  type: 'accepted'
  id: number
  revision: number
}

export interface ErrorMessage {
  type: 'error'
  id: number | null
  message: string
}

export interface ExportedMessage {
  type: 'exported'
  id: number
  file: string
  bytes: number
  address: string
}

export interface FinishedMessage {
  type: 'finished'
  id: number
  revision: number
  digest: string | null
  frame: FrameMessage | null
}

export type ServerMessage =
  | StateMessage
  | ProgressMessage
  | FrameMessage
  | GeometryMessage
  | UnreachedMessage
  | CheckedMessage
  | CancelledMessage
  | NoticeMessage
  | AcceptedMessage
  | ErrorMessage
  | ExportedMessage
  | FinishedMessage
