// The amount of work of a test: a little as a rule, and more where the environment asks for it, as for long runs.
#ifndef WELLSPACE_TESTS_SUPPORT_AMOUNT_H_
#define WELLSPACE_TESTS_SUPPORT_AMOUNT_H_

#include <cstdlib>

namespace wellspace::test {

// The number in the environment's variable `name`, or `otherwise`.
inline int Amount(const char* name, int otherwise) {
  const char* wanted = std::getenv(name);
  return wanted != nullptr ? std::atoi(wanted) : otherwise;
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_AMOUNT_H_
