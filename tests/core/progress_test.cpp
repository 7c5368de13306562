// SPDX-License-Identifier: Apache-2.0
// Progress of a part of a longer stage.
#include "base/progress.h"

#include <gtest/gtest.h>

#include <string>

namespace deltalux {
namespace {

TEST(Progress, APartShowsNothingAndIsCancelledWithTheWhole) {
  Progress whole;
  whole.begin("all of it", 2);
  Progress part(&whole);
  part.begin("a part", 1);
  part.advance(1);
  EXPECT_EQ(whole.stage(), std::string("all of it"));
  EXPECT_EQ(whole.fraction(), 0);
  EXPECT_NO_THROW(part.check());
  whole.cancel();
  EXPECT_TRUE(part.cancelled());
  EXPECT_THROW(part.check(), Cancelled);
  EXPECT_THROW(part.begin("another part", 1), Cancelled);
}

}  // namespace
}  // namespace deltalux
