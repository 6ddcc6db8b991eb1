// Operations whose work ends the process, among others that run beside them.
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/server/histories/simulated_server.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/simulated_disk.h"
#include "tests/support/clouds.h"

namespace wellspace::server {
namespace {

constexpr int kSessions = 30;  // within the jobs that a tenant may have in line
constexpr int kWorkers = 4;

// The processes of a server that has `poison` of its operations die of them, until none is under way any more.
class CrashingWorkTest : public ::testing::TestWithParam<int> {
 protected:
  // By the vertices that they may have at most, meshers know whose they are.
  static uint64_t LimitOf(int number) { return 10'000 + static_cast<uint64_t>(number); }
  bool IsPoison(int number) const { return poison_.contains(number); }

  absl::StatusOr<std::unique_ptr<core::Mesher>> Create(const core::MeshParameters& parameters, const core::Input& input,
                                                       core::RunContext& context) {
    // All that may run beside this one begins before it goes on.
    while (!disk_.is_dead() && server_.RunJobBeside()) {
    }
    if (!disk_.is_dead() && IsPoison(static_cast<int>(parameters.max_vertices - LimitOf(0)))) {
      disk_.DieAt(disk_.operations());
      (void)disk_.files().Remove("/anything");
    }
    return core::Mesher::Create(parameters, input, context);
  }

  void MakeSessions() {
    for (int number = 0; number < kSessions; ++number) {
      v1::CreateSessionRequest create;
      *create.mutable_parameters() = UnitCubeParameters(2);
      create.mutable_parameters()->set_max_vertices(LimitOf(number));
      names_.push_back(server_.Create(create).response.session().name());
      ASSERT_TRUE(server_.Upload({UploadRequest(names_.back(), 0, UniformPoints(5, 2, number))}).is_ok);
      v1::StartRefinementRequest start;
      start.set_name(names_.back());
      ASSERT_TRUE(server_.Refine(start).is_ok);
    }
  }

  SimulatedDisk disk_;
  SimulatedServer server_{
      disk_,
      {},
      [this](const auto& parameters, const auto& input, auto& context) { return Create(parameters, input, context); },
      kWorkers};
  std::set<int> poison_;
  std::vector<std::string> names_;
};

TEST_P(CrashingWorkTest, CostsNoneThatRunsBesideIt) {
  ASSERT_TRUE(server_.Start().ok());
  test::SplitMix64 random(test::Seed(5));
  for (int i = 0; i < GetParam(); ++i) {
    poison_.insert(static_cast<int>(random.Below(kSessions)));
  }
  MakeSessions();
  int processes = 1;
  while (true) {
    while (!disk_.is_dead() && server_.RunJob()) {
      server_.EndStep();
    }
    if (!disk_.is_dead()) {
      break;
    }
    server_.Kill();
    disk_.Restart(SimulatedDisk::Loss::kProcess, 0);
    ASSERT_TRUE(server_.Start().ok());
    ++processes;
  }
  EXPECT_LE(processes, 3 * GetParam() + 1);
  for (int number = 0; number < kSessions; ++number) {
    const auto operations = server_.ListOperations(names_[number]).response;
    ASSERT_EQ(operations.operations_size(), 1);
    const v1::Operation& operation = operations.operations(0);
    EXPECT_EQ(operation.state(), IsPoison(number) ? v1::Operation::STATE_FAILED : v1::Operation::STATE_SUCCEEDED)
        << number << ": " << operation.error().message();
    EXPECT_EQ(operation.error().message().find("the server died 3 times") != std::string::npos, IsPoison(number));
  }
  disk_.DieAt(disk_.operations());
}

INSTANTIATE_TEST_SUITE_P(Of, CrashingWorkTest, ::testing::Values(1, 3, 8));

}  // namespace
}  // namespace wellspace::server
