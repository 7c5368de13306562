// SPDX-License-Identifier: Apache-2.0
// The server's session as the page sees it: its state, what it reports, and the edits that it takes.
import { Connection, type Answer } from './connection'
import type {
  CheckedMessage,
  RequestMessage,
  ExportedMessage,
  FrameMessage,
  ProgressMessage,
  ServerMessage,
  StateMessage,
  UnreachedMessage,
  ValuesFrame,
} from './protocol'
import { Signal } from './signal'

const MOST_UNANSWERED = 3 // steps of a drag on the way; later ones wait and replace each other

export type Link = 'connecting' | 'connected' | 'lost'
export interface Note {
  kind: 'notice' | 'error'
  text: string
}

type DragStep = Extract<RequestMessage, { type: 'move' | 'dim' | 'dims' }>

export class RemoteSession {
  readonly link = new Signal<Link>('connecting')
  readonly state = new Signal<StateMessage | null>(null)
  readonly progress = new Signal<ProgressMessage | null>(null)
  readonly frame = new Signal<FrameMessage | null>(null)
  readonly unreached = new Signal<UnreachedMessage | null>(null)
  readonly checked = new Signal<CheckedMessage | null>(null)
  readonly exported = new Signal<ExportedMessage | null>(null)
  readonly note = new Signal<Note | null>(null)
  onValues: (frame: ValuesFrame) => void = () => {}
  onConnected: () => void = () => {}
  onGeometry: (number: number) => void = () => {} // values from now on are those of another mesh
  onMoved: (sent: number, revision: number) => void = () => {} // when it was sent, what it became
  private readonly connection: Connection
  private unanswered = 0
  private readonly waitingSteps = new Map<string, DragStep>() // by what they move or dim

  constructor(address: string) {
    this.connection = new Connection(address, {
      message: (message) => this.receive(message),
      values: (frame) => this.onValues(frame),
      connected: () => {
        this.unanswered = 0
        this.link.value = 'connected'
        this.onConnected()
      },
      lost: () => {
        this.link.value = 'lost'
        this.progress.value = null
      },
    })
  }

  connect(): void {
    this.connection.connect()
  }

  /** Sends an edit; what the server refuses is shown, and the answer says so. */
  async edit(edit: RequestMessage): Promise<Answer> {
    const sent = performance.now()
    const answer = await this.connection.send(edit)
    if (answer.accepted && edit.type === 'move') this.onMoved(sent, answer.revision)
    if (!answer.accepted) this.note.value = { kind: 'error', text: answer.message }
    return answer
  }

  /** Sends a step of a drag, or keeps the newest until the server has answered earlier ones. */
  async drag(step: DragStep): Promise<Answer | 'waiting'> {
    const subject =
      step.type === 'move'
        ? `object ${step.name}`
        : `lights ${step.type === 'dim' ? step.group : Object.keys(step.factors).join()}`
    if (step.dragging && this.unanswered >= MOST_UNANSWERED) {
      this.waitingSteps.set(subject, step)
      return 'waiting'
    }
    this.waitingSteps.delete(subject) // what comes now is newer
    this.unanswered++
    const answer = await this.edit(step)
    this.unanswered = Math.max(this.unanswered - 1, 0)
    const [next] = this.waitingSteps.values()
    if (next) void this.drag(next)
    return answer
  }

  acknowledge(seq: number): void {
    this.connection.acknowledge(seq)
  }

  /** Whether steps of a drag are on the way to the server, which its state does not show yet. */
  get busyDragging(): boolean {
    return this.unanswered > 0 || this.waitingSteps.size > 0
  }

  private receive(message: ServerMessage): void {
    switch (message.type) {
      case 'state':
        if (!['baking', 'preview', 'checking'].includes(message.phase)) this.progress.value = null
        this.state.value = message
        break
      case 'progress':
        this.progress.value = message
        break
      case 'frame':
        this.frame.value = message
        break
      case 'unreached':
        this.unreached.value = message
        break
      case 'checked':
        this.progress.value = null
        this.checked.value = message
        break
      case 'exported':
        this.progress.value = null
        this.exported.value = message
        break
      case 'cancelled':
        this.progress.value = null
        this.note.value = { kind: 'notice', text: `The ${message.task} was cancelled.` }
        break
      case 'notice':
        this.note.value = { kind: 'notice', text: message.message }
        break
      case 'geometry':
        this.onGeometry(message.number)
        break
      case 'accepted':
        break
      case 'error':
        if (message.id === null) this.note.value = { kind: 'error', text: message.message }
        break
    }
  }
}
