#include "client/cli/face_rules.h"

#include <algorithm>
#include <iterator>

#include "client/rule_names.h"

namespace wellspace::cli {
namespace {

// The client library does not know the core, so that each has the rules; they meet here alone.
struct Row {
  client::FaceRule rule;
  core::FaceRule of_core;
};
constexpr Row kRows[] = {
    {client::FaceRule::kBox, core::FaceRule::kBox},
    {client::FaceRule::kHoles, core::FaceRule::kHoles},
    {client::FaceRule::kEvenOdd, core::FaceRule::kEvenOdd},
    {client::FaceRule::kUnion, core::FaceRule::kUnion},
};

}  // namespace

std::vector<std::string> FaceRuleNames() {
  std::vector<std::string> names;
  for (const Row& row : kRows) {
    names.emplace_back(client::FaceRuleName(row.rule));
  }
  return names;
}

client::FaceRule FaceRuleOf(std::string_view name) {
  const auto* const row = std::find_if(std::begin(kRows), std::end(kRows),
                                       [&](const Row& one) { return name == client::FaceRuleName(one.rule); });
  return row->rule;
}

core::FaceRule CoreFaceRuleOf(client::FaceRule rule) {
  return std::find_if(std::begin(kRows), std::end(kRows), [&](const Row& row) { return rule == row.rule; })->of_core;
}

}  // namespace wellspace::cli
