#include "client/rule_names.h"

namespace wellspace::client {

const char* FaceRuleName(FaceRule rule) {
  switch (rule) {
    case FaceRule::kBox:
      return "box";
    case FaceRule::kHoles:
      return "holes";
    case FaceRule::kUnion:
      return "union";
    case FaceRule::kEvenOdd:
      break;
  }
  return "even-odd";
}

const char* CrossingRuleName(CrossingRule rule) {
  switch (rule) {
    case CrossingRule::kRefuse:
      return "refuse";
    case CrossingRule::kSnap:
      return "snap";
    case CrossingRule::kSplit:
      break;
  }
  return "split";
}

const char* SolidRuleName(SolidRule rule) {
  switch (rule) {
    case SolidRule::kHoles:
      return "holes";
    case SolidRule::kWinding:
      return "winding";
    case SolidRule::kBox:
      return "box";
    case SolidRule::kEvenOdd:
      break;
  }
  return "even-odd";
}

}  // namespace wellspace::client
