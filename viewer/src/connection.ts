// SPDX-License-Identifier: Apache-2.0
// The WebSocket to the server: sends edits, hands on what arrives, comes back after a loss.
import { decodeFrame, type RequestMessage, type ServerMessage, type ValuesFrame } from './protocol'

const FIRST_WAIT = 250 // ms before the first new attempt; doubles up to LONGEST_WAIT
const LONGEST_WAIT = 4000

export interface Listener {
  message(message: ServerMessage): void
  values(frame: ValuesFrame): void
  connected(): void
  lost(): void
}

/** What became of an edit. */
export type Answer = { accepted: true; revision: number } | { accepted: false; message: string }

export class Connection {
  private socket: WebSocket | null = null
  private wait = FIRST_WAIT
  private nextId = 1
  private readonly waiting = new Map<number, (answer: Answer) => void>()

  constructor(
    private readonly address: string,
    private readonly listener: Listener,
  ) {}

  get open(): boolean {
    return this.socket?.readyState === WebSocket.OPEN
  }

  connect(): void {
    const socket = new WebSocket(this.address)
    socket.binaryType = 'arraybuffer'
    socket.onopen = () => {
      this.wait = FIRST_WAIT
      this.listener.connected()
    }
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.receive(event.data)
    socket.onclose = () => this.lose()
    this.socket = socket
  }

  /** Sends an edit; the promise tells whether the server took it. */
  send(edit: RequestMessage): Promise<Answer> {
    const id = this.nextId++
    if (!this.open) return Promise.resolve({ accepted: false, message: 'The server is away.' })
    this.socket?.send(JSON.stringify({ ...edit, id }))
    return new Promise((resolve) => this.waiting.set(id, resolve))
  }

  /** Tells the server that a frame is on the screen, so that it may send the next one. */
  acknowledge(seq: number): void {
    if (this.open) this.socket?.send(JSON.stringify({ type: 'ack', seq }))
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data !== 'string') {
      this.listener.values(decodeFrame(data))
      return
    }
    const message = JSON.parse(data) as ServerMessage
    if (message.type === 'accepted') this.answer(message.id, { accepted: true, revision: message.revision })
    if (message.type === 'error' && message.id !== null) {
      this.answer(message.id, { accepted: false, message: message.message })
    }
    this.listener.message(message)
  }

  private answer(id: number, answer: Answer): void {
    this.waiting.get(id)?.(answer)
    this.waiting.delete(id)
  }

  private lose(): void {
    for (const id of [...this.waiting.keys()]) {
      this.answer(id, { accepted: false, message: 'The connection was lost before an answer came.' })
    }
    this.listener.lost()
    window.setTimeout(() => this.connect(), this.wait)
    this.wait = Math.min(2 * this.wait, LONGEST_WAIT)
  }
}
