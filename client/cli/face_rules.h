// The rules that choose the faces of a domain: their names, and the rule of each library that a name stands for.
#ifndef WELLSPACE_CLIENT_CLI_FACE_RULES_H_
#define WELLSPACE_CLIENT_CLI_FACE_RULES_H_

#include <string>
#include <string_view>
#include <vector>

#include "client/types.h"
#include "core/validate/validate_domain.h"

namespace wellspace::cli {

// The values of --faces.
std::vector<std::string> FaceRuleNames();

// REQUIRES:   `name` is one of FaceRuleNames().
client::FaceRule FaceRuleOf(std::string_view name);
core::FaceRule CoreFaceRuleOf(client::FaceRule rule);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_FACE_RULES_H_
