// prototype
#include "estimate/disc_tree_build.h"
#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace deltalux::estimate {
namespace {

constexpr int kBins = 16;
const int kSweep = getenv("SWEEP") ? atoi(getenv("SWEEP")) : 128;

struct Item { Vec3f low; uint32_t index; Vec3f high; uint32_t pad; 
  float centre(int a) const { return low[a] + high[a]; } };

float half_area(const Box& b) {
  const Vec3f e = b.extent();
  return e.x * e.y + e.y * e.z + e.z * e.x;
}
float leaves_of(size_t n) { return float(n); }

struct Binary { Box box; uint32_t left = 0, right = 0; uint32_t begin = 0, end = 0; 
  float cost[kWidth + 1]; uint8_t share[kWidth + 1]; 
  bool leaf() const { return left == 0; } };

struct Builder {
  std::vector<Item> items;
  std::vector<Binary> nodes;

  uint32_t split_sweep(uint32_t begin, uint32_t end) {
    const uint32_t n = end - begin;
    Item* first = items.data() + begin;
    float best = INFINITY; int best_axis = 0; uint32_t best_k = (n / 2 + 7) / 8 * 8;
    std::vector<float> right(n / 8 + 2);
    int sorted = -1;
    for (int axis = 0; axis < 3; ++axis) {
      sort(first, n, axis); sorted = axis;
      Box b;
      uint32_t k = n;
      while (k > 8) {
        const uint32_t stop = (k - 1) / 8 * 8;
        for (; k > stop; --k) { b.grow(first[k-1].low); b.grow(first[k-1].high); }
        right[k / 8] = half_area(b) * leaves_of(n - k);
      }
      Box l;
      for (uint32_t i = 0; i + 8 < n; ) {
        for (int j = 0; j < 8; ++j, ++i) { l.grow(first[i].low); l.grow(first[i].high); }
        const float cost = half_area(l) * leaves_of(i) + right[i / 8];
        if (cost < best) best = cost, best_axis = axis, best_k = i;
      }
    }
    if (best_axis != sorted) sort(first, n, best_axis);
    return begin + best_k;
  }
  void sort(Item* first, uint32_t n, int axis) {
    std::sort(first, first + n, [axis](const Item& a, const Item& b) {
      const float x = a.centre(axis), y = b.centre(axis);
      return x < y || (x == y && a.index < b.index);
    });
  }
  uint32_t split_binned(uint32_t begin, uint32_t end) {
    const uint32_t n = end - begin;
    Box cb;
    for (uint32_t i = begin; i < end; ++i) cb.grow(items[i].low + items[i].high);
    Box box[3][kBins]; uint32_t count[3][kBins] = {};
    float scale[3];
    for (int a = 0; a < 3; ++a) { const float e = cb.high[a] - cb.low[a]; scale[a] = e > 0 ? kBins * 0.9999f / e : 0; }
    const auto bin = [&](const Item& it, int a) { return std::min(kBins - 1, int((it.centre(a) - cb.low[a]) * scale[a])); };
    for (uint32_t i = begin; i < end; ++i)
      for (int a = 0; a < 3; ++a) {
        const int b = bin(items[i], a);
        box[a][b].grow(items[i].low); box[a][b].grow(items[i].high); ++count[a][b];
      }
    float best = INFINITY; int best_axis = -1, best_bin = 0;
    for (int a = 0; a < 3; ++a) {
      if (scale[a] == 0) continue;
      float right[kBins]; Box b; uint32_t c = 0;
      for (int k = kBins - 1; k > 0; --k) { b.grow(box[a][k]); c += count[a][k]; right[k] = c ? half_area(b) * leaves_of(c) : INFINITY; }
      Box l; c = 0;
      for (int k = 0; k + 1 < kBins; ++k) {
        l.grow(box[a][k]); c += count[a][k];
        if (!c) continue;
        const float cost = half_area(l) * leaves_of(c) + right[k + 1];
        if (cost < best) best = cost, best_axis = a, best_bin = k;
      }
    }
    if (best_axis < 0) return begin + (n / 2 + 7) / 8 * 8;
    auto* mid = std::partition(items.data() + begin, items.data() + end, [&](const Item& it) { return bin(it, best_axis) <= best_bin; });
    return uint32_t(mid - items.data());
  }
  uint32_t build(uint32_t begin, uint32_t end) {
    const uint32_t id = uint32_t(nodes.size());
    nodes.push_back({});
    Box box;
    for (uint32_t i = begin; i < end; ++i) { box.grow(items[i].low); box.grow(items[i].high); }
    nodes[id].box = box; nodes[id].begin = begin; nodes[id].end = end;
    const uint32_t n = end - begin;
    if (n > kWidth) {
      const uint32_t mid = int(n) <= kSweep ? split_sweep(begin, end) : split_binned(begin, end);
      const uint32_t l = build(begin, mid);
      const uint32_t r = build(mid, end);
      nodes[id].left = l; nodes[id].right = r;
    }
    weigh(nodes[id]);
    return id;
  }
  void weigh(Binary& b) {
    if (b.leaf()) { for (int k = 0; k <= kWidth; ++k) b.cost[k] = 0, b.share[k] = 0; return; }
    const Binary &l = nodes[b.left], &r = nodes[b.right];
    for (int k = 2; k <= kWidth; ++k) {
      b.cost[k] = k > 2 ? b.cost[k - 1] : INFINITY; b.share[k] = k > 2 ? b.share[k-1] : 0;
      int total = k; (void)total;
      for (int i = 1; i < k; ++i) {
        const float c = l.cost[i] + r.cost[k - i];
        if (c < b.cost[k]) b.cost[k] = c, b.share[k] = uint8_t(i | (k << 4));
      }
    }
    b.cost[1] = half_area(b.box) + b.cost[kWidth]; b.share[1] = 0;
    for (int k = 2; k <= kWidth; ++k) if (b.cost[1] <= b.cost[k]) b.cost[k] = b.cost[1], b.share[k] = 0;
  }
  // children of wide node
  void gather(uint32_t id, int k, bool root, std::vector<uint32_t>& out) {
    const Binary& b = nodes[id];
    if (b.leaf()) { out.push_back(id); return; }
    uint8_t share = b.share[k];
    if (root) { // recompute without the single option
      float best = INFINITY;
      const Binary &l = nodes[b.left], &r = nodes[b.right];
      for (int i = 1; i < k; ++i) { const float c = l.cost[i] + r.cost[k - i]; if (c < best) best = c, share = uint8_t(i | (k << 4)); }
    } else if (k == 1 || !share) { out.push_back(id); return; }
    const int i = share & 15, kk = share >> 4;
    gather(b.left, i, false, out);
    gather(b.right, kk - i, false, out);
  }
};

}  // namespace

void DiscTree::build(const samples::DiscSet& discs) {
  Builder b;
  b.items.reserve(discs.size());
  double reach = 0;
  max_radius = 0;
  for (uint32_t i = 0; i < discs.size(); ++i) {
    const Vec3f c = discs.centre[i];
    const Vec3d n(discs.normal[i]);
    const double nn = dot(n, n);
    Item it; it.index = i;
    for (int a = 0; a < 3; ++a) {
      const double e = discs.radius[i] * std::sqrt(std::max(0.0, 1.0 - n[a] * n[a] / nn));
      it.low[a] = float(c[a] - e); it.high[a] = float(c[a] + e);
      reach = std::max({reach, std::fabs(double(it.low[a])), std::fabs(double(it.high[a]))});
    }
    b.items.push_back(it);
    max_radius = std::max(max_radius, discs.radius[i]);
  }
  this->reach = float(reach);
  if (b.items.empty()) return;
  const uint32_t root = b.build(0, uint32_t(b.items.size()));
  nodes.reserve(b.items.size()/30); leaves.reserve(b.items.size()/7);
  struct Work { uint32_t binary, wide; int depth; };
  std::vector<Work> stack{{root, 0, 1}};
  nodes.resize(1);
  std::vector<uint32_t> kids;
  const auto emit_leaf = [&](const Binary& leaf) {
    DiscLeaf out{};
    for (uint32_t i = leaf.begin; i < leaf.end; ++i) {
      const uint32_t k = b.items[i].index, lane = i - leaf.begin;
      out.cx[lane] = discs.centre[k].x, out.cy[lane] = discs.centre[k].y, out.cz[lane] = discs.centre[k].z;
      out.nx[lane] = discs.normal[k].x, out.ny[lane] = discs.normal[k].y, out.nz[lane] = discs.normal[k].z;
      out.radius[lane] = discs.radius[k];
      out.disc[lane] = k | (discs.outline[k] == samples::kWholeDisc ? 0 : kClippedBit);
    }
    leaves.push_back(out);
  };
  while (!stack.empty()) {
    const Work w = stack.back(); stack.pop_back();
    depth = std::max(depth, w.depth);
    kids.clear();
    b.gather(w.binary, kWidth, true, kids);
    std::stable_partition(kids.begin(), kids.end(), [&](uint32_t k) { return !b.nodes[k].leaf(); });
    DiscNode node{};
    uint32_t inner = 0;
    for (uint32_t k : kids) inner += !b.nodes[k].leaf();
    node.inner = inner;
    node.inner_base = uint32_t(nodes.size());
    node.leaf_base = uint32_t(leaves.size()) - inner;
    for (int lane = 0; lane < kWidth; ++lane) {
      Box box;
      if (lane < int(kids.size())) box = b.nodes[kids[lane]].box;
      for (int a = 0; a < 3; ++a) node.bound[2*a][lane] = box.low[a], node.bound[2*a+1][lane] = box.high[a];
    }
    nodes.resize(nodes.size() + inner);
    for (uint32_t i = 0; i < inner; ++i) stack.push_back({kids[i], node.inner_base + i, w.depth + 1});
    for (size_t i = inner; i < kids.size(); ++i) emit_leaf(b.nodes[kids[i]]);
    nodes[w.wide] = node;
  }
}

}  // namespace deltalux::estimate
