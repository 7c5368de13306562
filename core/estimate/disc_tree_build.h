#pragma once
#include <vector>
#include "estimate/disc_tree.h"
#include "samples/disc_set.h"
#include <sys/mman.h>
#include <cstdlib>
template <class T> struct Huge { using value_type = T; Huge() = default; template<class U> Huge(const Huge<U>&) {}
 T* allocate(size_t n) { size_t b = (n * sizeof(T) + (2<<20) - 1) & ~size_t((2<<20) - 1); void* p = aligned_alloc(2<<20, b);
#ifdef HUGE_PAGES
 madvise(p, b, MADV_HUGEPAGE);
#endif
 return (T*)p; }
 void deallocate(T* p, size_t) { free(p); }
 bool operator==(const Huge&) const { return true; } };
namespace deltalux::estimate {
struct DiscTree {
  std::vector<DiscNode, Huge<DiscNode>> nodes; std::vector<DiscLeaf, Huge<DiscLeaf>> leaves; int depth = 0; float reach = 0, max_radius = 0;
  void build(const samples::DiscSet& discs);
};
}
