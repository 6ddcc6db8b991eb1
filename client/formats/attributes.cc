#include "client/formats/attributes.h"

#include <set>
#include <string_view>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

constexpr std::string_view kSyntax = "<>&\"'/\\";

}  // namespace

std::vector<std::string> NamesToWrite(std::span<const Attribute> attributes) {
  std::set<std::string> taken = {"boundary", "input", "origin", "region", "weights"};
  std::vector<std::string> names;
  for (const Attribute& attribute : attributes) {
    std::string name = attribute.name.empty() ? "attribute" : attribute.name;
    for (char& c : name) {
      const auto byte = static_cast<unsigned char>(c);
      if (byte < 0x20 || byte == 0x7f || kSyntax.find(c) != std::string_view::npos) {
        c = '_';
      }
    }
    while (!taken.insert(name).second) {
      absl::StrAppend(&name, "_");
    }
    names.push_back(name);
  }
  return names;
}

}  // namespace wellspace::formats
