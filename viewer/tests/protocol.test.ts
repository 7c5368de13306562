// SPDX-License-Identifier: Apache-2.0
// Binary frames, made here byte by byte as docs/reference/viewer-protocol.md says.
import { DataUtils } from 'three'
import { describe, expect, it } from 'vitest'
import { decodeFrame, type Run } from '../src/protocol'
import { Values } from '../src/values'

function frame(
  scale: number,
  flags: number,
  runs: Run[],
  values: number[],
  seq = 7,
  revision = 3,
): ArrayBuffer {
  const buffer = new ArrayBuffer(24 + 8 * runs.length + 2 * values.length)
  const view = new DataView(buffer)
  ;[0x58544c44, seq, revision].forEach((word, i) => view.setUint32(4 * i, word, true))
  view.setFloat32(12, scale, true)
  view.setUint32(16, flags, true)
  view.setUint32(20, runs.length, true)
  runs.forEach(({ first, count }, i) => {
    view.setUint32(24 + 8 * i, first, true)
    view.setUint32(28 + 8 * i, count, true)
  })
  const start = 24 + 8 * runs.length
  values.forEach((value, i) => view.setUint16(start + 2 * i, DataUtils.toHalfFloat(value * scale), true))
  return buffer
}

describe('binary frames', () => {
  it('are read with header, runs and values', () => {
    const decoded = decodeFrame(frame(0.5, 7, [{ first: 0, count: 2 }], [1, 2, 3, 4, 5, 6, 7, 8]))
    expect(decoded).toMatchObject({ seq: 7, revision: 3, scale: 0.5, full: true, preview: true, rest: true })
    expect(decoded.runs).toEqual([{ first: 0, count: 2 }])
    expect([...decoded.halves].map(DataUtils.fromHalfFloat)).toEqual([0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4])
  })

  it('without changes are frames, too', () => {
    expect(decodeFrame(frame(1, 0, [], [])).runs).toEqual([])
  })

  it('are refused where they are cut, too long, or something else', () => {
    const whole = frame(1, 1, [{ first: 0, count: 1 }], [1, 2, 3, 4])
    expect(() => decodeFrame(whole.slice(0, 10))).toThrow('without the mark')
    expect(() => decodeFrame(whole.slice(0, whole.byteLength - 2))).toThrow('found 38 bytes, expected 40')
    expect(() => decodeFrame(frame(1, 1, [{ first: 0, count: 2 }], [1, 2, 3, 4]))).toThrow('expected 48')
    expect(() => decodeFrame(new ArrayBuffer(40))).toThrow('without the mark')
  })
})

describe('values', () => {
  it('take runs over and leave the rest', () => {
    const values = new Values(4)
    values.apply(
      decodeFrame(frame(2, 1, [{ first: 0, count: 4 }], [1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4])),
    )
    values.apply(
      decodeFrame(
        frame(
          2,
          0,
          [
            { first: 1, count: 1 },
            { first: 3, count: 1 },
          ],
          [8, 8, 8, 0, 9, 0, 0, 0.5],
        ),
      ),
    )
    expect([0, 1, 2].map((vertex) => values.photopic(vertex))).toEqual(
      [1, 8, 3].map((v) => expect.closeTo(v, 12)),
    )
    expect(values.rgb(3)).toEqual([9, 0, 0])
    expect(values.standardError(3)).toBe(0.5)
  })

  it('change by exactly nothing where they are equal, at any scale', () => {
    const values = new Values(2)
    values.apply(decodeFrame(frame(1, 1, [{ first: 0, count: 2 }], [0.25, 3, 5, 0, 1, 1, 1, 0])))
    values.reference = values.snapshot()
    values.apply(decodeFrame(frame(16, 1, [{ first: 0, count: 2 }], [0.25, 3, 5, 0, 2, 1, 1, 0])))
    expect(values.change(0)).toBe(0)
    expect(values.change(1)).toBeCloseTo(0.2126, 12)
  })

  it('refuse another scale in a part, and vertices that do not exist', () => {
    const values = new Values(1)
    expect(() => values.apply(decodeFrame(frame(2, 0, [], [])))).toThrow('the scale changed')
    expect(() => values.apply(decodeFrame(frame(1, 0, [{ first: 1, count: 1 }], [1, 1, 1, 1])))).toThrow(
      'to vertex 2 of 1',
    )
  })
})
