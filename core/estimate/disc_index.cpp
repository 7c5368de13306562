#include "estimate/disc_index.h"
#include <immintrin.h>
#include <cstdlib>
#include <cstdio>
#include <bit>
#include <cstring>
#include "estimate/crossing.h"
namespace deltalux::estimate {
DiscIndex::DiscIndex(samples::DiscSet discs, segments::SegmentEnd rule, const Workers&, Progress*)
  : discs_(std::move(discs)), rule_(rule) { tree_.build(discs_); 
  if (getenv("DUMP")) fprintf(stderr, "nodes %zu leaves %zu depth %d fill %.2f\n", tree_.nodes.size(), tree_.leaves.size(), tree_.depth, double(discs_.size())/tree_.leaves.size()/8); }

namespace {
#ifndef BATCH
#define BATCH 64
#endif
#ifndef CHUNK
#define CHUNK 32
#endif
#ifndef AHEAD
#define AHEAD 8
#endif
constexpr int kBatch = BATCH, kChunk = CHUNK, kAhead = AHEAD;
constexpr int kSegBits = 26; constexpr uint32_t kRef = (1u << kSegBits) - 1;
struct alignas(64) Ray { float inverse[3], near_shift[3], far_shift[3], end; uint32_t near_row[3]; };
struct Segment { float o[3], w[3], length, extended; };

alignas(64) uint64_t g_lut[256];
struct LutInit { LutInit() { for (int m = 0; m < 256; ++m) { uint64_t v = 0; int k = 0; for (int i = 0; i < 8; ++i) if (m >> i & 1) v |= uint64_t(i) << (8 * k++); g_lut[m] = v; } } } lut_init;
inline __m256i perm(uint32_t mask) { return _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i*)&g_lut[mask])); }

inline void prefetch4(const void* p) { const char* c = (const char*)p; _mm_prefetch(c, _MM_HINT_T0); _mm_prefetch(c+64, _MM_HINT_T0); _mm_prefetch(c+128, _MM_HINT_T0); _mm_prefetch(c+192, _MM_HINT_T0); }
}

#ifdef __AVX512VL__
#define COMPRESS(v, m) _mm256_maskz_compress_epi32(__mmask8(m), v)
#else
#define COMPRESS(v, m) _mm256_permutevar8x32_epi32(v, perm(m))
#endif
Stats DiscIndex::accumulate(const segments::SegmentSpan& s, int sign, const EnergySums& sums, HitSlots* slots) const {
  Stats stats;
  if (tree_.nodes.empty()) return stats;
  std::vector<uint32_t> stack_mem(kBatch + 8 * kChunk * (tree_.depth + 2)), leaf_mem(1 << 16), hit_seg(1<<16), hit_disc(1<<16);
  uint32_t* stack = stack_mem.data(); uint32_t* leafq = leaf_mem.data();
  Ray rays[kBatch]; Segment segs[kBatch];
  uint32_t chunk[kChunk + kAhead];
  uint32_t hits_of[kBatch];
  const DiscNode* nodes = tree_.nodes.data(); const DiscLeaf* leaves = tree_.leaves.data();
  const __m256i iota = _mm256_setr_epi32(0,1,2,3,4,5,6,7);
  for (size_t base = 0; base < s.count; base += kBatch) {
    const int n = int(std::min<size_t>(kBatch, s.count - base));
    for (int i = 0; i < n; ++i) {
      const size_t g = base + i;
      Segment& q = segs[i]; Ray& r = rays[i];
      q = {{s.ox[g], s.oy[g], s.oz[g]}, {s.dx[g], s.dy[g], s.dz[g]}, s.length[g], s.extended[g]};
      const float pad = 0x1p-19f * (tree_.reach + std::max({std::fabs(q.o[0]), std::fabs(q.o[1]), std::fabs(q.o[2])}));
      r.end = segment_end(rule_, q.length, q.extended, tree_.max_radius);
      for (int a = 0; a < 3; ++a) {
        const float w = std::fabs(q.w[a]) < 1e-12f ? std::copysign(1e-12f, q.w[a]) : q.w[a];
        const bool neg = w < 0;
        r.inverse[a] = 1.0f / w;
        const float p = neg ? -pad : pad;
        r.near_shift[a] = (q.o[a] + p) * r.inverse[a];
        r.far_shift[a] = (q.o[a] - p) * r.inverse[a];
        r.near_row[a] = (2 * a + neg) * 32;
      }
      stack[i] = uint32_t(i) << kSegBits;
      hits_of[i] = 0;
    }
    uint32_t top = n, leaf_count = 0, hit_count = 0;
    while (top) {
      const uint32_t take = std::min<uint32_t>(top, kChunk);
      top -= take;
      for (uint32_t i = 0; i < take; ++i) chunk[i] = stack[top + i];
      for (uint32_t i = 0; i < kAhead; ++i) chunk[take + i] = chunk[0];
#ifndef NOPF
      for (uint32_t i = 0; i < kAhead; ++i) prefetch4(&nodes[chunk[i] & kRef]);
#endif
      for (uint32_t i = 0; i < take; ++i) {
        const uint32_t item = chunk[i];
#ifndef NOPF
        prefetch4(&nodes[chunk[i + kAhead] & kRef]);
#endif
        const DiscNode& node = nodes[item & kRef];
        const Ray& r = rays[item >> kSegBits];
        const char* rows = (const char*)&node;
        const uint32_t nx = r.near_row[0], ny = r.near_row[1], nz = r.near_row[2];
        const auto plane = [&](uint32_t row, int a, const float* shift) {
          return _mm256_fmsub_ps(_mm256_load_ps((const float*)(rows + row)), _mm256_broadcast_ss(&r.inverse[a]), _mm256_broadcast_ss(&shift[a]));
        };
        const __m256 near = _mm256_max_ps(_mm256_max_ps(plane(nx, 0, r.near_shift), plane(ny, 1, r.near_shift)),
                                          _mm256_max_ps(plane(nz, 2, r.near_shift), _mm256_setzero_ps()));
        const __m256 far = _mm256_min_ps(_mm256_min_ps(plane(nx ^ 32, 0, r.far_shift), plane(ny ^ 32, 1, r.far_shift)),
                                          _mm256_min_ps(plane(nz ^ 32, 2, r.far_shift), _mm256_broadcast_ss(&r.end)));
        #ifdef __AVX512VL__
        const uint32_t mask = _mm256_cmp_ps_mask(near, far, _CMP_LE_OQ);
#else
        const uint32_t mask = uint32_t(_mm256_movemask_ps(_mm256_cmp_ps(near, far, _CMP_LE_OQ)));
#endif
        const uint32_t inner_mask = mask & ((1u << node.inner) - 1), leaf_mask = mask & ~((1u << node.inner) - 1);
        const uint32_t seg = item & ~kRef;
        const __m256i in = _mm256_add_epi32(_mm256_set1_epi32(int(node.inner_base + seg)), iota);
        const __m256i lf = _mm256_add_epi32(_mm256_set1_epi32(int(node.leaf_base + seg)), iota);
        _mm256_storeu_si256((__m256i*)(stack + top), COMPRESS(in, inner_mask));
        top += std::popcount(inner_mask);
        _mm256_storeu_si256((__m256i*)(leafq + leaf_count), COMPRESS(lf, leaf_mask));
        leaf_count += std::popcount(leaf_mask);
      }
      stats.node_tests += take;
    }
    stats.disc_tests += 8 * leaf_count;
    for (uint32_t i = 0; i < kAhead; ++i) leafq[leaf_count + i] = 0;
#ifndef NOPF
    for (uint32_t i = 0; i < kAhead; ++i) prefetch4(&leaves[leafq[i] & kRef]);
#endif
    for (uint32_t i = 0; i < leaf_count; ++i) {
#ifndef NOPF
      prefetch4(&leaves[leafq[i + kAhead] & kRef]);
#endif
      const DiscLeaf& leaf = leaves[leafq[i] & kRef];
      const uint32_t sg = leafq[i] >> kSegBits;
      const Segment& q = segs[sg];
      const __m256 wx = _mm256_broadcast_ss(&q.w[0]), wy = _mm256_broadcast_ss(&q.w[1]), wz = _mm256_broadcast_ss(&q.w[2]);
      const __m256 ox = _mm256_broadcast_ss(&q.o[0]), oy = _mm256_broadcast_ss(&q.o[1]), oz = _mm256_broadcast_ss(&q.o[2]);
      const __m256 nx = _mm256_load_ps(leaf.nx), ny = _mm256_load_ps(leaf.ny), nz = _mm256_load_ps(leaf.nz);
      const __m256 cx = _mm256_load_ps(leaf.cx), cy = _mm256_load_ps(leaf.cy), cz = _mm256_load_ps(leaf.cz);
      const __m256 facing = nx * wx + ny * wy + nz * wz;
      const __m256 height = nx * (cx - ox) + ny * (cy - oy) + nz * (cz - oz);
      const __m256 t = height / facing;
      const __m256 px = (ox + t * wx) - cx, py = (oy + t * wy) - cy, pz = (oz + t * wz) - cz;
      const __m256 d2 = px * px + py * py + pz * pz;
      const __m256 radius = _mm256_load_ps(leaf.radius);
      __m256 end;
      if (rule_ == segments::SegmentEnd::first) end = _mm256_broadcast_ss(&q.length);
      else if (rule_ == segments::SegmentEnd::second) end = _mm256_broadcast_ss(&q.extended);
      else end = _mm256_min_ps(_mm256_broadcast_ss(&q.length) + _mm256_set1_ps(segments::kBoundedRadii) * radius, _mm256_broadcast_ss(&q.extended));
      const __m256 z = _mm256_setzero_ps();
#ifdef __AVX512VL__
      const uint32_t mask = _mm256_mask_cmp_ps_mask(_mm256_mask_cmp_ps_mask(_mm256_mask_cmp_ps_mask(_mm256_cmp_ps_mask(facing,z,_CMP_LT_OQ), t, z, _CMP_GT_OQ), t, end, _CMP_LE_OQ), d2, radius*radius, _CMP_LE_OQ);
#else
      const __m256 ok = _mm256_and_ps(_mm256_and_ps(_mm256_cmp_ps(facing, z, _CMP_LT_OQ), _mm256_cmp_ps(t, z, _CMP_GT_OQ)),
         _mm256_and_ps(_mm256_cmp_ps(t, end, _CMP_LE_OQ), _mm256_cmp_ps(d2, radius * radius, _CMP_LE_OQ)));
      const uint32_t mask = uint32_t(_mm256_movemask_ps(ok));
#endif
      _mm256_storeu_si256((__m256i*)(hit_disc.data() + hit_count), COMPRESS(_mm256_load_si256((const __m256i*)leaf.disc), mask));
      _mm256_storeu_si256((__m256i*)(hit_seg.data() + hit_count), _mm256_set1_epi32(int(sg)));
      hit_count += std::popcount(mask);
    }
    if (slots) for (int i = 0; i < n; ++i) slots[base + i] = {};
    for (uint32_t i = 0; i < hit_count; ++i) __builtin_prefetch(&discs_.id[hit_disc[i] & ~kClippedBit]);
    for (uint32_t i = 0; i < hit_count; ++i) {
      const size_t g = base + hit_seg[i];
      __builtin_prefetch(sums.data + ((s.slab ? s.slab[g] : 0) * sums.samples + discs_.id[hit_disc[i] & ~kClippedBit]) * 3, 1);
    }
    for (uint32_t i = 0; i < hit_count; ++i) {
      const uint32_t sg = hit_seg[i]; const size_t g = base + sg;
      const uint32_t d = hit_disc[i] & ~kClippedBit;
      if ((hit_disc[i] & kClippedBit) && !crosses(discs_, d, {s.ox[g], s.oy[g], s.oz[g]}, {s.dx[g], s.dy[g], s.dz[g]}, s.length[g], s.extended[g], rule_).hit) continue;
#ifdef PLAIN
      int64_t* cell = sums.data + ((s.slab ? s.slab[g] : 0) * sums.samples + discs_.id[d]) * 3;
      for (int c = 0; c < 3; ++c) cell[c] += sign * int64_t(s.power[3 * g + c]);
#else
      sums.add(s.slab ? s.slab[g] : 0, discs_.id[d], s.power + 3 * g, sign);
#endif
      if (slots) {
        if (hits_of[sg] < 2) slots[g].disc[hits_of[sg]] = d; else slots[g].disc[0] = slots[g].disc[1] = HitSlots::kMany;
        ++hits_of[sg];
      }
      ++stats.hits;
    }
  }
  return stats;
}
}
