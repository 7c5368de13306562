#pragma once
#include <vector>
#include "estimate/disc_tree.h"
#include "samples/disc_set.h"
namespace deltalux::estimate {
struct DiscTree {
  std::vector<DiscNode> nodes; std::vector<DiscLeaf> leaves; int depth = 0; float reach = 0, max_radius = 0;
  void build(const samples::DiscSet& discs);
};
}
