// The word that was probably meant, of those that there are.
#include "core/base/closest_word.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace wellspace::core {
namespace {

TEST(ClosestWordTest, IsTheNearestOrTheOnlyOneThatStartsSo) {
  const std::vector<std::string> words = {"mesh", "check", "render", "refine", "server", "session"};
  EXPECT_EQ(ClosestWord("mehs", words), "mesh");
  EXPECT_EQ(ClosestWord("msh", words), "mesh");
  EXPECT_EQ(ClosestWord("meshes", words), "mesh");
  EXPECT_EQ(ClosestWord("chekc", words), "check");
  EXPECT_EQ(ClosestWord("rend", words), "render");
  EXPECT_EQ(ClosestWord("re", words), "");  // two start so
  EXPECT_EQ(ClosestWord("knit", words), "");
  EXPECT_EQ(ClosestWord("", words), "");
  EXPECT_EQ(ClosestWord(std::string(1 << 20, 'm'), words), "");
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3u);
  EXPECT_EQ(EditDistance("ab", "ba"), 1u);
  EXPECT_EQ(EditDistance("", "abc"), 3u);
}

}  // namespace
}  // namespace wellspace::core
