#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <future>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/statistics.h"

namespace wellspace::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(WithThousandsTest, GroupsByThree) {
  EXPECT_EQ(WithThousands(0), "0");
  EXPECT_EQ(WithThousands(999), "999");
  EXPECT_EQ(WithThousands(1000), "1,000");
  EXPECT_EQ(WithThousands(~uint64_t{0}), "18,446,744,073,709,551,615");
}

TEST(ProgressLineTest, ShowsPhaseFractionAndVerticesWithin79Columns) {
  const std::string line = ProgressLine(
      {.phase = "refinement", .vertices = 1234567, .estimated_vertices = 0, .simplices = 0, .fraction = 0.5});
  EXPECT_EQ(line, "refinement [###############---------------]  50%  1,234,567 vertices");
  const std::string longest = ProgressLine({.phase = std::string(100, 'x'),
                                            .vertices = ~uint64_t{0},
                                            .estimated_vertices = 0,
                                            .simplices = 0,
                                            .fraction = 7});
  EXPECT_LE(longest.size(), 79u);
  EXPECT_THAT(longest, HasSubstr("100%"));
}

TEST(ExitCodeTest, OfEveryKindOfError) {
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), 0);
  EXPECT_EQ(ExitCodeOf(absl::InternalError("")), 1);
  EXPECT_EQ(ExitCodeOf(absl::FailedPreconditionError("")), 1);
  EXPECT_EQ(ExitCodeOf(absl::InvalidArgumentError("")), 2);
  EXPECT_EQ(ExitCodeOf(absl::NotFoundError("")), 2);
  EXPECT_EQ(ExitCodeOf(absl::PermissionDeniedError("")), 2);
  EXPECT_EQ(ExitCodeOf(absl::UnavailableError("")), 3);
  EXPECT_EQ(ExitCodeOf(absl::ResourceExhaustedError("")), 4);
  EXPECT_EQ(ExitCodeOf(absl::DeadlineExceededError("")), 5);
}

client::Mesh SmallMesh(int dimension) {
  client::Mesh mesh;
  mesh.dimension = dimension;
  mesh.domain_low = std::vector<double>(dimension, 0.1);
  mesh.domain_high = std::vector<double>(dimension, 1);
  mesh.input_vertex = {0, 1, 0, 2, 2, 1};
  mesh.statistics.input_points = 6;
  mesh.statistics.duplicates = 3;
  mesh.statistics.vertices = 1007;
  mesh.statistics.min_angle_deg = 20.5;
  mesh.statistics.seconds = {{"tree", 0.25}, {"total", 1.5}};
  mesh.statistics.counters = {{"cuts", 77}};
  return mesh;
}

TEST(StatisticsJsonTest, HasEveryFigure) {
  const nlohmann::json json = nlohmann::json::parse(StatisticsJson(SmallMesh(2)));
  EXPECT_EQ(json["dimension"], 2);
  EXPECT_EQ(json["domain_low"][0], 0.1);
  EXPECT_EQ(json["input_points"], 6);
  EXPECT_EQ(json["duplicates"], 3);
  EXPECT_EQ(json["vertices"], 1007);
  EXPECT_EQ(json["min_angle_deg"], 20.5);
  EXPECT_EQ(json["seconds"]["total"], 1.5);
  EXPECT_EQ(json["counters"]["cuts"], 77);
  EXPECT_EQ(json["duplicate_of"], nlohmann::json::parse("[[2, 0], [4, 2], [5, 1]]"));
  const nlohmann::json solid = nlohmann::json::parse(StatisticsJson(SmallMesh(3)));
  EXPECT_EQ(solid["min_dihedral_deg"], 20.5);
  EXPECT_FALSE(solid.contains("min_angle_deg"));
}

TEST(SummaryTest, OneLine) {
  const std::string line = Summary(SmallMesh(3));
  EXPECT_THAT(line, HasSubstr("6 points (3 duplicates) -> 1,007 vertices, 0 tetrahedra"));
  EXPECT_THAT(line, HasSubstr("dihedral angles at least 20.50\u00b0; 1.50 s"));
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST(OptionsTest, NumbersAreCorrectlyRoundedAndMayBeNegative) {
  CLI::App app;
  double number = 0;
  std::vector<double> numbers;
  AddNumber(app, "--number", number, "");
  AddNumbers(app, "--numbers", numbers, "");
  app.parse("--number 9007199254740993.00000000000000000000000001 --numbers -1,.5,+2e3");
  EXPECT_EQ(number, 9007199254740994.0);
  EXPECT_THAT(numbers, ElementsAre(-1, 0.5, 2000));
  for (const char* text : {"--number one", "--number nan", "--number 1x", "--numbers 1,,2", "--numbers 1;2"}) {
    EXPECT_THROW(app.parse(text), CLI::ValidationError) << text;
  }
}

TEST(InterruptTest, FirstSignalRequestsAStopAndTheOldMaskReturns) {
  sigset_t before;
  sigset_t after;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  for (const int signal : {SIGINT, SIGTERM}) {
    Interrupt interrupt;
    EXPECT_EQ(interrupt.signal(), 0);
    EXPECT_FALSE(interrupt.token().stop_requested());
    std::promise<void> stopped;
    const std::stop_callback callback(interrupt.token(), [&stopped] { stopped.set_value(); });
    ASSERT_EQ(kill(getpid(), signal), 0);
    stopped.get_future().wait();
    EXPECT_EQ(interrupt.signal(), signal);
  }
  pthread_sigmask(SIG_SETMASK, nullptr, &after);
  EXPECT_EQ(sigismember(&before, SIGINT), sigismember(&after, SIGINT));
  EXPECT_EQ(sigismember(&after, SIGINT), 0);
}

TEST(InterruptDeathTest, SecondSignalEndsTheProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        Interrupt interrupt;
        std::promise<void> stopped;
        const std::stop_callback callback(interrupt.token(), [&stopped] { stopped.set_value(); });
        kill(getpid(), SIGINT);
        stopped.get_future().wait();
        kill(getpid(), SIGINT);
        while (true) {
          pause();
        }
      },
      testing::ExitedWithCode(130), "");
}

}  // namespace
}  // namespace wellspace::cli
