// SPDX-License-Identifier: Apache-2.0
// Random numbers as a function of (seed, path, bounce, dimension), so that any path can be traced
// again from any bounce. The first four dimensions of a path are an Owen-scrambled Sobol' sequence.
#pragma once
#include <array>
#include <bit>
#include <cstdint>

namespace deltalux {

/// Finaliser with full avalanche (Stafford's variant 13 of the MurmurHash3 finaliser).
constexpr uint64_t mix64(uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

constexpr uint64_t combine(uint64_t a, uint64_t b) {
  return mix64(a + 0x9e3779b97f4a7c15ull * (b + 1));
}

/// 24 random bits as a float in [0, 1).
constexpr float unit_float(uint64_t bits) { return float(uint32_t(bits >> 40)) * 0x1p-24f; }
constexpr float unit_float32(uint32_t bits) { return float(bits >> 8) * 0x1p-24f; }

/// One stream per (seed, path); draws are indexed, not sequential.
class PathRandom {
 public:
  constexpr PathRandom(uint64_t seed, uint64_t path) : key_(combine(mix64(seed), path)) {}
  constexpr float operator()(uint32_t bounce, uint32_t dimension) const {
    return unit_float(combine(key_, (uint64_t(bounce) << 8) | dimension));
  }

 private:
  uint64_t key_;
};

namespace sobol {

/// Direction numbers of the first four Sobol' dimensions (Joe & Kuo 2008), computed from their
/// primitive polynomials.
constexpr std::array<std::array<uint32_t, 32>, 4> make_directions() {
  std::array<std::array<uint32_t, 32>, 4> v{};
  for (int i = 0; i < 32; ++i) v[0][i] = 1u << (31 - i);
  constexpr int degree[4] = {0, 1, 2, 3};
  constexpr uint32_t coefficients[4] = {0, 0, 1, 1};
  constexpr uint32_t initial[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 3, 0}, {1, 3, 1}};
  for (int d = 1; d < 4; ++d) {
    const int s = degree[d];
    for (int i = 0; i < 32; ++i) {
      if (i < s) {
        v[d][i] = initial[d][i] << (31 - i);
        continue;
      }
      uint32_t value = v[d][i - s] ^ (v[d][i - s] >> s);
      for (int k = 1; k < s; ++k)
        if ((coefficients[d] >> (s - 1 - k)) & 1) value ^= v[d][i - k];
      v[d][i] = value;
    }
  }
  return v;
}
inline constexpr auto kDirections = make_directions();

constexpr uint32_t reverse_bits(uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  return (x >> 16) | (x << 16);
}

/// Hash-based Owen scrambling (Laine & Karras 2011; constants of Burley 2020, JCGT 9(4)).
constexpr uint32_t owen_scramble(uint32_t x, uint32_t seed) {
  x = reverse_bits(x);
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return reverse_bits(x);
}

/// XORs of direction numbers by byte of the index: a point takes four look-ups per dimension.
constexpr std::array<std::array<std::array<uint32_t, 256>, 4>, 4> make_tables() {
  std::array<std::array<std::array<uint32_t, 256>, 4>, 4> table{};
  for (int d = 0; d < 4; ++d)
    for (int byte = 0; byte < 4; ++byte)
      for (int value = 1; value < 256; ++value) {
        const int low = std::countr_zero(unsigned(value));
        table[d][byte][value] =
            table[d][byte][value & (value - 1)] ^ kDirections[d][8 * byte + low];
      }
  return table;
}
inline constexpr auto kTables = make_tables();

constexpr uint32_t point(uint32_t index, int dimension) {
  const auto& t = kTables[dimension];
  return t[0][index & 255] ^ t[1][index >> 8 & 255] ^ t[2][index >> 16 & 255] ^ t[3][index >> 24];
}

/// Point `index` of the four-dimensional sequence scrambled by `seed`, in [0, 1)^4.
constexpr std::array<float, 4> sample(uint32_t index, uint64_t seed) {
  const uint32_t shuffled = owen_scramble(index, uint32_t(mix64(seed)));
  std::array<float, 4> out{};
  for (int d = 0; d < 4; ++d)
    out[d] = unit_float32(owen_scramble(point(shuffled, d), uint32_t(combine(seed, d))));
  return out;
}

}  // namespace sobol
}  // namespace deltalux
