// Calls are admitted until the registry closes, and it waits for the last one.
#include "server/calls/call_registry.h"

#include <cstdint>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

TEST(CallRegistry, AdmitsUntilClosed) {
  CallRegistry registry;
  const CallRegistry::Admission first = registry.Add([] {});
  EXPECT_TRUE(first.admitted);
  registry.Close();
  const CallRegistry::Admission second = registry.Add([] {});
  EXPECT_FALSE(second.admitted);
  EXPECT_NE(first.id, second.id);
  EXPECT_FALSE(registry.WaitUntilEmpty(absl::ZeroDuration()));
  registry.Remove(first.id);
  registry.Remove(second.id);
  EXPECT_TRUE(registry.WaitUntilEmpty(absl::ZeroDuration()));
}

TEST(CallRegistry, AbortedCallsMayRemoveThemselves) {
  CallRegistry registry;
  int aborted = 0;
  std::vector<uint64_t> ids(3);
  for (uint64_t& id : ids) {
    id = registry
             .Add([&registry, &aborted, &id] {
               ++aborted;
               registry.Remove(id);
             })
             .id;
  }
  registry.AbortAll();
  EXPECT_EQ(aborted, 3);
  EXPECT_TRUE(registry.WaitUntilEmpty(absl::ZeroDuration()));
}

TEST(CallRegistry, WaitEndsWithTheLastCall) {
  CallRegistry registry;
  const uint64_t id = registry.Add([] {}).id;
  std::thread remover([&registry, id] { registry.Remove(id); });
  EXPECT_TRUE(registry.WaitUntilEmpty(absl::Minutes(1)));
  remover.join();
}

}  // namespace
}  // namespace wellspace::server
