// What is counted and logged of meshes, refinements and errors.
#include "server/observability/work_observer.h"

#include <memory>
#include <sstream>
#include <string>

#include "gtest/gtest.h"
#include "server/wire/errors.h"
#include "spdlog/sinks/ostream_sink.h"

namespace wellspace::server {
namespace {

class WorkObserverTest : public ::testing::Test {
 protected:
  WorkObserverTest() { log_.set_pattern("%l %v"); }

  // The line that `report` makes, without its end.
  std::string LineOf(const RefinementReport& report) {
    lines_.str("");
    observer_.OnRefinement(report);
    std::string line = lines_.str();
    return line.substr(0, line.find('\n'));
  }

  const RefinementReport report_{.operation = "sessions/1/operations/2",
                                 .tenant = "a",
                                 .status = absl::OkStatus(),
                                 .duration = absl::Milliseconds(1500),
                                 .points = 7,
                                 .replayed_steps = 0,
                                 .vertices = 11,
                                 .simplices = 13};
  std::ostringstream lines_;
  spdlog::logger log_{"test", std::make_shared<spdlog::sinks::ostream_sink_mt>(lines_)};
  WorkCounters counters_;
  WorkObserver observer_{log_, counters_};
};

TEST_F(WorkObserverTest, CountsMeshes) {
  observer_.OnMesh(3, 4);
  EXPECT_EQ(lines_.str(), "");
  observer_.OnRefinement(report_);
  EXPECT_EQ(counters_.vertices_made, 14u);
  EXPECT_EQ(counters_.simplices_made, 17u);
}

TEST_F(WorkObserverTest, ARefinementHasALine) {
  EXPECT_EQ(LineOf(report_),
            "info event=refinement operation=sessions/1/operations/2 tenant=a code=OK seconds=1.500000 points=7 "
            "vertices=11");
  RefinementReport replayed = report_;
  replayed.replayed_steps = 5;
  EXPECT_EQ(LineOf(replayed), LineOf(report_) + " replayed_steps=5");
}

TEST_F(WorkObserverTest, AnErrorIsLoggedAsClientsSeeIt) {
  RefinementReport failed = report_;
  failed.vertices = failed.simplices = 0;
  failed.status = absl::CancelledError("stopped");
  const std::string figures = " seconds=1.500000 points=7 vertices=0 message=";
  const std::string begin = " event=refinement operation=sessions/1/operations/2 tenant=a code=";
  EXPECT_EQ(LineOf(failed), "info" + begin + "CANCELLED" + figures + "stopped");
  failed.status = absl::UnknownError("why");
  EXPECT_EQ(LineOf(failed), "error" + begin + "INTERNAL" + figures + "\"internal error: why\"")
      << "the server is at fault";
}

}  // namespace
}  // namespace wellspace::server
