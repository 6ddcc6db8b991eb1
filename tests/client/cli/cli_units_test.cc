// Small parts of the tool: numbers, progress, JSON, exit codes and summaries, against texts that were written by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <future>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "client/cli/exit_codes.h"
#include "client/cli/helpful_threads.h"
#include "client/cli/interrupt.h"
#include "client/cli/meshing_options.h"
#include "client/cli/options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/statistics.h"
#include "client/formats/io/output_file.h"
#include "client/json/json.h"
#include "client/json/statistics.h"
#include "client/time_left.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Optional;

TEST(WithThousandsTest, GroupsByThree) {
  EXPECT_EQ(WithThousands(0), "0");
  EXPECT_EQ(WithThousands(999), "999");
  EXPECT_EQ(WithThousands(1000), "1,000");
  EXPECT_EQ(WithThousands(~uint64_t{0}), "18,446,744,073,709,551,615");
}

TEST(ProgressLineTest, ShowsPhaseFractionAndVerticesWithin79Columns) {
  const std::string line = ProgressLine("refinement", 0.5, "1,234,567 vertices");
  EXPECT_EQ(line, "refinement [########--------]  50%  1,234,567 vertices");
  EXPECT_EQ(ProgressLine("refinement", 0.5, "1,234,567 vertices", "2 h 5 min"), line + ", 2 h 5 min left");
  for (const char* left : {"", "12 s"}) {
    const std::string longest = ProgressLine(std::string(100, 'x'), 7, std::string(100, '9') + " vertices", left);
    EXPECT_EQ(longest.size(), 79u);
    EXPECT_THAT(longest, HasSubstr("100%"));
    EXPECT_THAT(longest, Not(HasSubstr("left")));
  }
}

TEST(ProgressLineTest, TakesAnyFraction) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::string begin = ProgressLine("tree", 0, "0 vertices");
  for (const double fraction : {std::nan(""), -std::nan(""), -kInfinity, -1e300, -0.0}) {
    EXPECT_EQ(ProgressLine("tree", fraction, "0 vertices"), begin);
  }
  EXPECT_EQ(ProgressLine("tree", kInfinity, "0 vertices"), ProgressLine("tree", 1, "0 vertices"));
  EXPECT_EQ(ProgressLine("tree", 1e300, "0 vertices"), ProgressLine("tree", 1, "0 vertices"));
}

TEST(MeanRateTest, IsThatSinceTheFirstNote) {
  const absl::Time start = absl::FromUnixSeconds(1'000'000);
  client::MeanRate rate;
  EXPECT_EQ(rate.At(100, start), std::nullopt);
  EXPECT_EQ(rate.At(200, start + absl::Milliseconds(499)), std::nullopt);
  EXPECT_EQ(rate.At(100, start + absl::Seconds(1)), std::nullopt);  // none came
  EXPECT_EQ(rate.At(300, start + absl::Seconds(2)), 100);
  EXPECT_EQ(rate.At(500, start + absl::Seconds(4)), 100);
  EXPECT_EQ(rate.At(600, start - absl::Seconds(4)), std::nullopt);  // a clock that was set back
}

TEST(TimeLeftTest, IsThatOfTheMeanSpeed) {
  const absl::Time start = absl::UnixEpoch();
  client::TimeLeft left;
  EXPECT_EQ(left.At(0, start - absl::Hours(1)), std::nullopt);  // it waited in a queue
  EXPECT_EQ(left.At(0.1, start), std::nullopt);
  EXPECT_EQ(left.At(0.11, start + absl::Seconds(100)), std::nullopt);  // one percent says nothing
  EXPECT_EQ(left.At(0.2, start + absl::Seconds(1)), std::nullopt);     // nor does a second
  EXPECT_THAT(left.At(0.35, start + absl::Seconds(10)), Optional(absl::Seconds(26)));
  EXPECT_THAT(left.At(0.6, start + absl::Seconds(10)), Optional(absl::Seconds(8)));
  for (const double fraction : {1.0, 2.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(left.At(fraction, start + absl::Seconds(10)), std::nullopt) << fraction;
  }
}

TEST(TimeLeftTest, TextIsRoundedUp) {
  EXPECT_EQ(client::TimeText(absl::Milliseconds(1)), "1 s");
  EXPECT_EQ(client::TimeText(absl::Seconds(59)), "59 s");
  EXPECT_EQ(client::TimeText(absl::Seconds(59.5)), "1 min");
  EXPECT_EQ(client::TimeText(absl::Seconds(61)), "2 min");
  EXPECT_EQ(client::TimeText(absl::Minutes(60)), "1 h 0 min");
  EXPECT_EQ(client::TimeText(absl::Minutes(125)), "2 h 5 min");
  EXPECT_EQ(client::TimeText(absl::Hours(99)), "99 h 0 min");
  EXPECT_EQ(client::TimeText(absl::Hours(100)), "");
  EXPECT_EQ(client::TimeText(absl::InfiniteDuration()), "");
}

TEST(JsonTextTest, HasNoControlCharactersAndNoBytesThatAreNoText) {
  EXPECT_EQ(client::JsonText({{"a", "\x1b[2J\x7f\xc2\x9b\xc3\xa9\xff"}}, /*indented=*/false),
            "{\"a\":\"\\u001b[2J\\u007f\\u009b\xc3\xa9\xef\xbf\xbd\"}");
}

TEST(ExitCodeTest, OfEveryKindOfError) {
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), 0);
  EXPECT_EQ(ExitCodeOf(absl::InternalError("")), 1);
  EXPECT_EQ(ExitCodeOf(absl::CancelledError("")), 1);
  EXPECT_EQ(ExitCodeOf(absl::FailedPreconditionError("")), 7);
  EXPECT_EQ(ExitCodeOf(absl::AbortedError("")), 7);
  EXPECT_EQ(ExitCodeOf(absl::InvalidArgumentError("")), 2);
  EXPECT_EQ(ExitCodeOf(absl::NotFoundError("")), 2);
  EXPECT_EQ(ExitCodeOf(absl::PermissionDeniedError("")), 2);
  EXPECT_EQ(ExitCodeOf(absl::UnavailableError("")), 3);
  EXPECT_EQ(ExitCodeOf(absl::ResourceExhaustedError("")), 4);
  EXPECT_EQ(ExitCodeOf(absl::DeadlineExceededError("")), 5);
}

const std::vector<uint32_t> kInputVertex = {0, 1, 0, 2, 2, 1};

client::MeshHeader SmallMesh(int dimension) {
  client::MeshHeader mesh;
  mesh.dimension = dimension;
  mesh.domain_low = std::vector<double>(dimension, 0.1);
  mesh.domain_high = std::vector<double>(dimension, 1);
  mesh.statistics.input_points = 6;
  mesh.statistics.duplicates = 3;
  mesh.statistics.vertices = 1007;
  mesh.statistics.min_angle_deg = 20.5;
  mesh.statistics.seconds = {{"tree", 0.25}, {"total", 1.5}};
  mesh.statistics.counters = {{"cuts", 77}};
  return mesh;
}

TEST(StatisticsJsonTest, HasEveryFigure) {
  const nlohmann::json json = nlohmann::json(client::StatisticsJson(SmallMesh(2), kInputVertex));
  EXPECT_EQ(json["dimension"], 2);
  EXPECT_EQ(json["domain_low"][0], 0.1);
  EXPECT_EQ(json["input_points"], 6);
  EXPECT_EQ(json["duplicates"], 3);
  EXPECT_EQ(json["vertices"], 1007);
  EXPECT_EQ(json["min_angle_deg"], 20.5);
  EXPECT_EQ(json["seconds"]["total"], 1.5);
  EXPECT_EQ(json["counters"]["cuts"], 77);
  EXPECT_EQ(json["duplicate_of"], nlohmann::json::parse("[[2, 0], [4, 2], [5, 1]]"));
  const nlohmann::json solid = nlohmann::json(client::StatisticsJson(SmallMesh(3), kInputVertex));
  EXPECT_EQ(solid["min_dihedral_deg"], 20.5);
  EXPECT_FALSE(solid.contains("min_angle_deg"));
}

TEST(SummaryTest, OneLine) {
  const std::string line = Summary(SmallMesh(3));
  EXPECT_THAT(line, HasSubstr("6 points (3 duplicates) -> 1,007 vertices, 0 tetrahedra"));
  EXPECT_THAT(line, HasSubstr("dihedral angles at least 20.50\u00b0; 1.50 s"));
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST(SummaryTest, NamesTheSimplicesOfTheDimension) {
  EXPECT_THAT(Summary(SmallMesh(2)), HasSubstr(" triangles"));
  EXPECT_THAT(Summary(SmallMesh(4)), HasSubstr(" simplices"));
}

TEST(SliverWarningTest, SaysWhatIsLeftAndWhy) {
  client::MeshHeader mesh = SmallMesh(3);
  EXPECT_EQ(SliverWarning(mesh), "");
  mesh.statistics.slivers.emplace();
  EXPECT_EQ(SliverWarning(mesh), "");
  mesh.statistics.slivers->left = 1200;
  mesh.statistics.slivers->left_by_demands = 1;
  mesh.statistics.slivers->left_by_work = 1199;
  mesh.statistics.slivers->flattest_left = {{{4, 7, 9, 11}, 0, client::SliverReason::kDemands}};
  EXPECT_EQ(
      SliverWarning(mesh),
      "warning: 1,200 slivers are left below --min-dihedral (1 where no new vertex keeps --rho and the sizes; 1,199 "
      "given up when the bound on work was reached, which a smaller --rho avoids)\n"
      "  vertices 4 7 9 11: 0\u00b0, by demands\n");
  EXPECT_THAT(Summary(mesh), HasSubstr("; 1,200 slivers could not be repaired"));
  const nlohmann::json slivers = nlohmann::json(client::StatisticsJson(mesh, kInputVertex))["slivers"];
  EXPECT_EQ(slivers["left_by"], nlohmann::json::parse(R"({"demands": 1, "angle": 0, "work": 1199})"));
  EXPECT_EQ(slivers["flattest_left"],
            nlohmann::json::parse(R"([{"vertices": [4, 7, 9, 11], "min_dihedral_deg": 0.0, "reason": "demands"}])"));
}

TEST(SummaryTest, SaysHowManyVerticesHaveMoved) {
  client::MeshHeader mesh = SmallMesh(3);
  EXPECT_THAT(Summary(mesh), testing::Not(HasSubstr("moved")));
  mesh.moved_vertex_count = 2;
  EXPECT_THAT(Summary(mesh), HasSubstr("; 2 vertices of the mesh before have moved"));
  const std::vector<uint32_t> moved = {5, 8};
  EXPECT_EQ(nlohmann::json(client::StatisticsJson(mesh, kInputVertex, moved))["moved_vertices"],
            nlohmann::json::parse("[5, 8]"));
}

constexpr client::MeshEstimate kEstimate = {
    .vertices = 1234567, .simplices = 7654321, .memory_bytes = uint64_t{3} << 29, .tree_leaves = 42};

TEST(EstimateTest, ForProgramsAndForPeople) {
  EXPECT_EQ(nlohmann::json::parse(EstimateJson(kEstimate, 3)), nlohmann::json::parse(R"({
    "dimension": 3, "vertices": 1234567, "simplices": 7654321, "memory_bytes": 1610612736, "tree_leaves": 42})"));
  EXPECT_EQ(EstimateText(kEstimate, 3),
            "vertices       1,234,567\n"
            "tetrahedra     7,654,321\n"
            "memory         1.5 GiB\n"
            "tree leaves    42\n");
}

TEST(WithBinaryUnitTest, RoundsToWhatPeopleRead) {
  EXPECT_EQ(WithBinaryUnit(0), "0 B");
  EXPECT_EQ(WithBinaryUnit(1023), "1023 B");
  EXPECT_EQ(WithBinaryUnit(1024), "1.0 KiB");
  EXPECT_EQ(WithBinaryUnit(10'188), "9.9 KiB");
  EXPECT_EQ(WithBinaryUnit(10'189), "10 KiB");
  EXPECT_EQ(WithBinaryUnit(1023 << 10), "1023 KiB");
  EXPECT_EQ(WithBinaryUnit((1 << 20) - 1), "1.0 MiB");
  EXPECT_EQ(WithBinaryUnit(~uint64_t{0}), "16 EiB");
}

TEST(SizeBoxesTest, HaveTwoCornersAndASize) {
  const auto boxes = SizeBoxesOf({{0, 1, 2, 3, 0.5}, {-1, -1, 1, 1, 0.25}}, 2);
  ASSERT_TRUE(boxes.ok()) << boxes.status();
  ASSERT_EQ(boxes->size(), 2u);
  EXPECT_THAT((*boxes)[0].low, ElementsAre(0, 1));
  EXPECT_THAT((*boxes)[0].high, ElementsAre(2, 3));
  EXPECT_EQ((*boxes)[0].max_circumradius, 0.5);
  EXPECT_EQ((*boxes)[1].max_circumradius, 0.25);
  EXPECT_TRUE(SizeBoxesOf({std::vector<double>(13, 1)}, 0).ok());
  const auto message = [](const std::vector<double>& numbers, int dimension) {
    const absl::Status status = SizeBoxesOf({{0, 0, 1, 1, 1}, numbers}, dimension).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_EQ(message({0, 0.5, 1, 1}, 0),
            "--size-box 0,0.5,1,1: expected low corner, high corner and size, 5 numbers in 2-D to 13 in 6-D, got 4");
  EXPECT_THAT(message({0, 1, 1}, 0), HasSubstr("got 3"));
  EXPECT_THAT(message(std::vector<double>(15, 1), 0), HasSubstr("got 15"));
  EXPECT_EQ(message({0, 0, 0, 1, 1, 1, 2}, 2),
            "--size-box 0,0,0,1,1,1,2: expected low corner, high corner and size, 5 numbers in 2-D, got 7");
}

TEST(OptionsTest, ListsOfNumbersComeAsOftenAsTheyAreGiven) {
  CLI::App app;
  std::vector<std::vector<double>> lists;
  std::string positional;
  AddNumberLists(app, "--box", lists, "");
  app.add_option("IN", positional);
  app.parse("--box -1,2,.5 cloud.csv --box 3,4");
  EXPECT_THAT(lists, ElementsAre(ElementsAre(-1, 2, 0.5), ElementsAre(3, 4)));
  EXPECT_EQ(positional, "cloud.csv");
  EXPECT_THROW(app.parse("--box 1,x"), CLI::ValidationError);
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

// A number that is not given is told from a 0, which is refused where it can be none.
TEST(OptionsTest, NoneStandsForAnOptionThatIsNotGiven) {
  CLI::App app;
  std::optional<double> number = 5;
  AddNumber(app, "--number", number, "");
  app.parse("--number none");
  EXPECT_FALSE(number.has_value());
  app.parse("--number 0.5");
  EXPECT_EQ(number, 0.5);
  app.parse("--number 0");
  EXPECT_EQ(number, 0.0);
  EXPECT_THROW(app.parse("--number nothing"), CLI::ValidationError);
}

// A cloud along the diagonal of the unit box of `dimension`.
std::vector<double> Diagonal(int dimension, int count) {
  std::vector<double> points;
  for (int i = 0; i < count; ++i) {
    points.insert(points.end(), dimension, i / (count - 1.0));
  }
  return points;
}

client::MeshOptions OptionsIn(int dimension) {
  client::MeshOptions options;
  options.dimension = dimension;
  return options;
}

TEST(HelpfulThreadsTest, SmallMeshesAreMadeByOne) {
  EXPECT_EQ(HelpfulThreads(OptionsIn(2), {}), 1);
  EXPECT_EQ(HelpfulThreads(OptionsIn(2), Diagonal(2, 5000)), 1);  // as coast-110m
  EXPECT_EQ(HelpfulThreads(OptionsIn(3), Diagonal(3, 3000)), 1);  // as spot
  EXPECT_EQ(HelpfulThreads(OptionsIn(2), Diagonal(2, 10'000)), 2);
  EXPECT_EQ(HelpfulThreads(OptionsIn(3), Diagonal(3, 100'000)), 20);
  EXPECT_EQ(HelpfulThreads(OptionsIn(5), Diagonal(5, 1000)), 2);
}

// A size makes many vertices of few points.
TEST(HelpfulThreadsTest, SizesCount) {
  const std::vector<double> cloud = Diagonal(2, 100);
  client::MeshOptions options = OptionsIn(2);
  int before = 1;
  for (const double size : {0.1, 0.01, 0.003, 0.001, 1e-6, 1e-150, 1e-320}) {
    options.max_circumradius = size;
    const int threads = HelpfulThreads(options, cloud);
    EXPECT_GE(threads, before) << size;
    before = threads;
  }
  EXPECT_EQ(before, kMostThreads);
  options.max_circumradius = 0.005;  // the box is 1.5 x 1.5
  EXPECT_EQ(HelpfulThreads(options, cloud), 9);
  options.domain_low = {0, 0};
  options.domain_high = {10, 10};
  EXPECT_EQ(HelpfulThreads(options, cloud), 400);
  options = OptionsIn(2);
  options.size_boxes = {{{0, 0}, {0.5, 0.5}, 0.001}};
  EXPECT_EQ(HelpfulThreads(options, cloud), 25);
  options.size_boxes[0].max_circumradius = -1;  // refused later
  EXPECT_GE(HelpfulThreads(options, cloud), 1);
}

// The number of threads that the command asks a server for.
TEST(HelpfulThreadsTest, AreAskedForUnlessTheUserSays) {
  const TemporaryFolder folder;
  std::string text;
  for (const double x : Diagonal(1, 20'000)) {
    text += std::to_string(x) + " 0.5\n";
  }
  const std::string cloud = folder.Write("cloud.xyz", text);
  const auto asked = [](const std::vector<std::string>& arguments) {
    CLI::App app;
    MeshingOptions options;
    options.AddTo(app);
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    int threads = 0;
    EXPECT_EQ(
        options.Run([&](client::Client&, const client::MeshOptions& mesh, const auto&, const client::CallOptions&) {
          threads = mesh.threads.value_or(0);
          return absl::OkStatus();
        }),
        0);
    return threads;
  };
  EXPECT_EQ(asked({cloud}), 4);
  EXPECT_EQ(asked({cloud, "--threads", "1"}), 1);
  EXPECT_EQ(asked({cloud, "--threads", "7"}), 7);
}

TEST(InterruptTest, FirstSignalRequestsAStopAndTheOldMaskReturns) {
  sigset_t before;
  sigset_t after;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
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

// Readers of files look at no stop token: `upload` and `add` read while they have one.
TEST(InterruptDeathTest, WhileAFileIsReadTheFirstSignalEndsTheProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        const Interrupt interrupt;
        const Interrupt::AtOnce reading(interrupt);
        kill(getpid(), SIGINT);
        while (true) {
          pause();
        }
      },
      testing::KilledBySignal(SIGINT), "");
}

TEST(InterruptTest, AfterAFileWasReadTheFirstSignalRequestsAStop) {
  Interrupt interrupt;
  { const Interrupt::AtOnce reading(interrupt); }
  std::promise<void> stopped;
  const std::stop_callback callback(interrupt.token(), [&stopped] { stopped.set_value(); });
  ASSERT_EQ(kill(getpid(), SIGINT), 0);
  stopped.get_future().wait();
  EXPECT_EQ(interrupt.signal(), SIGINT);
}

// `check` and `render` write pictures, and look at no stop token.
TEST(InterruptDeathTest, SignalsThatEndTheProcessLeaveNoTemporaryFile) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  TemporaryFolder folder;
  for (const auto& [signal, first] :
       {std::pair(SIGINT, Interrupt::First::kEnd), std::pair(SIGTERM, Interrupt::First::kEnd),
        std::pair(SIGHUP, Interrupt::First::kEnd), std::pair(SIGXCPU, Interrupt::First::kStop)}) {
    EXPECT_EXIT(
        {
          const Interrupt interrupt(first);
          absl::StatusOr<formats::OutputFile> file = formats::OutputFile::Create(folder.Path("picture.svg"));
          file->Write("<svg>");
          if (!file->Flush().ok() || folder.FileCount() != 1) {
            _exit(1);
          }
          kill(getpid(), signal);
          while (true) {
            pause();
          }
        },
        testing::KilledBySignal(signal), "");
    EXPECT_EQ(folder.FileCount(), 0) << signal;
  }
}

}  // namespace
}  // namespace wellspace::cli
