// The names of the rules of domains, as options of the tool, figures in JSON and arguments of Python have them.
#ifndef WELLSPACE_CLIENT_RULE_NAMES_H_
#define WELLSPACE_CLIENT_RULE_NAMES_H_

#include "client/types.h"

namespace wellspace::client {

const char* FaceRuleName(FaceRule rule);
const char* CrossingRuleName(CrossingRule rule);
const char* SolidRuleName(SolidRule rule);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_RULE_NAMES_H_
