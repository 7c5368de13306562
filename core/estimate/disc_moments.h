// SPDX-License-Identifier: Apache-2.0
// Integrals of polynomials over the intersection of a polygon with the unit disc, in closed form.
#pragma once
#include <algorithm>
#include <cmath>

namespace deltalux::estimate {

/// Integrals of 1, u, v, u u, u v, v v over (polygon ∩ unit disc), and the same times u u + v v.
/// Pass every edge of the polygon once, counter-clockwise; several polygons add up.
struct DiscMoments {
  static constexpr int kDegree[6] = {0, 1, 1, 2, 2, 2};
  double plain[6] = {}, squared[6] = {};

  double area() const { return plain[0]; }

  /// Adds the signed part between the edge from (pu, pv) to (qu, qv) and the centre.
  void add_edge(double pu, double pv, double qu, double qv) {
    const double du = qu - pu, dv = qv - pv;
    const double a = du * du + dv * dv, b = pu * du + pv * dv, c = pu * pu + pv * pv - 1;
    const double root = b * b - a * c;
    double enter = 1, leave = 1;  // the part of the edge inside the disc, if any
    if (root > 0) {
      enter = std::clamp((-b - std::sqrt(root)) / a, 0.0, 1.0);
      leave = std::clamp((-b + std::sqrt(root)) / a, 0.0, 1.0);
    }
    const double eu = pu + enter * du, ev = pv + enter * dv;
    const double lu = pu + leave * du, lv = pv + leave * dv;
    if (enter > 0) add_sector(pu, pv, eu, ev);
    if (leave > enter) add_triangle(eu, ev, lu, lv);
    if (leave < 1) add_sector(lu, lv, qu, qv);
  }

 private:
  void add_sector(double pu, double pv, double qu, double qv) {
    const double angle = std::atan2(pu * qv - pv * qu, pu * qu + pv * qv);
    const double p = std::hypot(pu, pv), q = std::hypot(qu, qv);
    if (!(p > 0 && q > 0)) return;
    pu /= p, pv /= p, qu /= q, qv /= q;
    const double half = (qu * qv - pu * pv) / 2;
    const double around[6] = {
        angle, qv - pv, pu - qu, angle / 2 + half, (qv * qv - pv * pv) / 2, angle / 2 - half};
    for (int k = 0; k < 6; ++k) {
      plain[k] += around[k] / (kDegree[k] + 2);
      squared[k] += around[k] / (kDegree[k] + 4);
    }
  }

  void add_triangle(double pu, double pv, double qu, double qv) {
    // Along rays from the centre, the integrand is a power; along the edge, a polynomial of at most
    // degree 4, for which three Gauss points are exact.
    constexpr double kAt[3] = {0.11270166537925831, 0.5, 0.88729833462074169};
    constexpr double kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    const double doubled_area = pu * qv - pv * qu;
    for (int i = 0; i < 3; ++i) {
      const double u = pu + kAt[i] * (qu - pu), v = pv + kAt[i] * (qv - pv);
      const double value[6] = {1, u, v, u * u, u * v, v * v};
      for (int k = 0; k < 6; ++k) {
        const double term = kWeight[i] * doubled_area * value[k];
        plain[k] += term / (kDegree[k] + 2);
        squared[k] += term * (u * u + v * v) / (kDegree[k] + 4);
      }
    }
  }
};

}  // namespace deltalux::estimate
