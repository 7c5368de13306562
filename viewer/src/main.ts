// SPDX-License-Identifier: Apache-2.0
// Entry: loads the scene that the server offers and starts the page.
import { App } from './app'
import { h } from './dom'
import type { SceneInfo } from './protocol'
import { Gone, type Loaded } from './remeshing'
import { testHooks } from './testHooks'
import { drawsInSoftware, type Antialiasing } from './three/smoothing'
import './theme.css'
import './style.css'
import './narrow.css'

const PROTOCOL = 1

async function load(address: string): Promise<Response> {
  const answer = await fetch(address)
  if (answer.status === 403)
    throw new Error('The address lacks the right token. Open the one that the viewer printed.')
  if (answer.status === 410) throw new Gone('The mesh that was asked for has been refined.')
  if (!answer.ok) throw new Error(`The server answered ${answer.status} to ${new URL(answer.url).pathname}.`)
  return answer
}

function antialiasingFor(asked: string | null): Antialiasing {
  if (asked === '0') return 'never'
  return drawsInSoftware() ? 'at rest' : 'always'
}

async function start(root: HTMLElement): Promise<void> {
  performance.mark('script')
  const query = new URLSearchParams(location.search)
  const token = query.get('token') ?? ''
  const withToken = (path: string) => `${path}?token=${encodeURIComponent(token)}`
  const loadScene = async (geometry?: number): Promise<Loaded> => {
    const asked = geometry === undefined ? '' : `&geometry=${geometry}`
    const info = (await (await load(withToken('scene.json') + asked)).json()) as SceneInfo
    performance.mark('scene')
    const arrays = await load(`${withToken('geometry.bin')}&geometry=${info.geometry}`)
    const buffer = await arrays.arrayBuffer()
    performance.mark('geometry')
    return { info, buffer }
  }
  const loading = loadScene()
  const antialiasing = antialiasingFor(query.get('aa')) // starts the graphics process, if none runs
  const loaded = await loading.catch((error: unknown) => {
    if (error instanceof Gone) return loadScene() // it was refined in between, which it rarely is
    throw error
  })
  const { info } = loaded
  if (info.protocol !== PROTOCOL) {
    throw new Error(`The server speaks protocol ${info.protocol}, this page ${PROTOCOL}. Reload the page.`)
  }
  const socket = new URL(withToken('ws'), document.baseURI)
  socket.protocol = socket.protocol === 'https:' ? 'wss:' : 'ws:'
  const options = { antialiasing, bench: query.has('bench') }
  document.title = `${info.name} · Deltalux`
  const app = new App(root, loaded, loadScene, token, socket.href, options)
  performance.mark('built')
  window.deltalux = testHooks(app)
}

const root = document.getElementById('app')!
root.append(h('p', { class: 'loading', role: 'status' }, 'Loading the scene …'))
start(root).catch((error: unknown) => {
  root.replaceChildren(
    h('p', { class: 'loading', role: 'alert' }, error instanceof Error ? error.message : String(error)),
  )
})
