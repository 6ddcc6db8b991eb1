// Servers that answer with numbers and text that cannot be: an error, or no harm.
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "client/error_details.h"
#include "client/printable.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/client/grpc/fake_server.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr char kSession[] = "sessions/one";
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Expects that the answer is refused, with this in the message.
void ExpectDamaged(const absl::Status& status, const std::string& message) {
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr(message));
}

TEST(HostileServer, FractionsAreFromZeroToOne) {
  FakeServer server;
  const std::vector<double> sent = {kNan, -kInfinity, -1, 0, 0.25, 1, 1e300, kInfinity};
  server.operations.watch = [&sent](grpc::ServerContext&, const auto&, auto& writer) {
    v1::WatchOperationResponse response;
    for (const double fraction : sent) {
      response.mutable_progress()->set_fraction(fraction);
      writer.Write(response);
    }
    response.mutable_operation()->mutable_progress()->set_fraction(kNan);
    writer.Write(response);
    return grpc::Status::OK;
  };
  std::vector<double> told;
  const absl::StatusOr<Operation> ended = server.Client().WatchOperation(
      "sessions/one/operations/two", [&told](const Progress& progress) { told.push_back(progress.fraction); });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_THAT(told, ElementsAre(0, 0, 0, 0, 0.25, 1, 1, 1));
  EXPECT_EQ(ended->progress.fraction, 0);
}

// The right answer to Locate about one point in 2-D.
v1::LocateResponse GoodPlace() {
  v1::LocateResponse response;
  response.add_simplices(3);
  for (const uint32_t vertex : {4, 5, 6}) {
    response.add_vertices(vertex);
  }
  for (const double coordinate : {0.5, 0.5, 0.0}) {
    response.add_coordinates(coordinate);
  }
  response.set_revision(9);
  response.set_vertex_count(7);
  return response;
}

class HostileTransfer : public ::testing::Test {
 protected:
  HostileTransfer() {
    answers_.resize(2);
    answers_[0].mutable_start()->set_revision(9);
    answers_[0].mutable_start()->set_row_count(2);
    for (const double value : {1.5, 2.5, 3.5, 4.5}) {
      answers_[1].mutable_values()->add_values(value);
    }
    server_.queries.transfer = [this](FakeQueries::TransferStream& stream) {
      v1::TransferValuesRequest request;
      requests_.clear();
      while (stream.Read(&request)) {
        requests_.push_back(request);
      }
      for (const v1::TransferValuesResponse& answer : answers_) {
        stream.Write(answer);
      }
      return grpc::Status::OK;
    };
  }

  absl::StatusOr<TransferredValues> Transfer(std::optional<uint64_t> revision = std::nullopt) {
    const std::vector<double> values = {1, 2, 3, 4, 5, 6};
    return server_.Client().TransferValues(kSession, values,
                                           {.from_revision = 8,
                                            .revision = revision,
                                            .place = FieldPlace::kSimplices,
                                            .components = 2,
                                            .conservative = true});
  }

  FakeServer server_;
  std::vector<v1::TransferValuesRequest> requests_;
  std::vector<v1::TransferValuesResponse> answers_;
};

TEST_F(HostileTransfer, WhatIsRightIsTaken) {
  const absl::StatusOr<TransferredValues> carried = Transfer(9);
  ASSERT_TRUE(carried.ok()) << carried.status();
  EXPECT_THAT(carried->values, ElementsAre(1.5, 2.5, 3.5, 4.5));
  EXPECT_EQ(carried->revision, 9u);
  ASSERT_EQ(requests_.size(), 2u);
  const v1::TransferValuesRequest::Start& start = requests_[0].start();
  EXPECT_EQ(start.name(), kSession);
  EXPECT_EQ(start.from_revision(), 8u);
  EXPECT_EQ(start.revision(), 9u);
  EXPECT_EQ(start.place(), v1::FIELD_PLACE_SIMPLICES);
  EXPECT_EQ(start.components(), 2u);
  EXPECT_TRUE(start.conservative());
  EXPECT_THAT(requests_[1].values().values(), ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(HostileTransfer, ValuesAreAsManyAsWereAnnounced) {
  const std::vector<v1::TransferValuesResponse> good = answers_;
  ExpectDamaged(Transfer(8).status(), "values on the mesh of revision 9, not 8");
  answers_[1].mutable_values()->add_values(5.5);
  ExpectDamaged(Transfer().status(), "more than 4 values");
  answers_[1].mutable_values()->mutable_values()->Truncate(3);
  ExpectDamaged(Transfer().status(), "3 of 4 values");
  answers_[1].mutable_values()->add_values(std::nan(""));
  ExpectDamaged(Transfer().status(), "a value that is not finite");
  answers_ = {good[1]};
  ExpectDamaged(Transfer().status(), "values without a start");
  answers_ = {good[0], good[0]};
  ExpectDamaged(Transfer().status(), "a second start of values");
  answers_ = {};
  ExpectDamaged(Transfer().status(), "0 of 0 values");
  answers_ = good;
  answers_[0].mutable_start()->set_row_count(~uint64_t{0} / 2 + 3);
  ExpectDamaged(Transfer().status(), "rows");
}

TEST_F(HostileTransfer, RowsAreWholeBeforeAnythingIsSent) {
  const std::vector<double> values = {1, 2, 3};
  for (const size_t components : {0, 2, 65}) {
    EXPECT_TRUE(absl::IsInvalidArgument(
        server_.Client().TransferValues(kSession, values, {.from_revision = 8, .components = components}).status()));
  }
}

class HostileLocate : public ::testing::Test {
 protected:
  HostileLocate() {
    server_.sessions.get = [](const auto&, v1::GetSessionResponse& response) {
      response.mutable_session()->mutable_parameters()->set_dimension(2);
      return grpc::Status::OK;
    };
    server_.queries.locate = [this](const v1::LocateRequest& request, v1::LocateResponse& response) {
      request_ = request;
      response = answer_;
      return grpc::Status::OK;
    };
  }

  absl::StatusOr<Located> Locate(const LocateOptions& options = {}) {
    const std::vector<double> point = {0.5, 0.25};
    return server_.Client().Locate(kSession, point, options);
  }

  FakeServer server_;
  v1::LocateRequest request_;
  v1::LocateResponse answer_ = GoodPlace();
};

TEST_F(HostileLocate, WhatIsRightIsTaken) {
  const absl::StatusOr<Located> located = Locate({.revision = 9});
  ASSERT_TRUE(located.ok()) << located.status();
  EXPECT_EQ(request_.revision(), 9u);
  EXPECT_EQ(located->vertex_count, 7u);
  EXPECT_THAT(located->vertices, ElementsAre(4, 5, 6));
  ASSERT_TRUE(Locate().ok());
  EXPECT_FALSE(request_.has_revision()) << "none is asked for";
  answer_.set_simplices(0, kNoSimplex);
  for (int i = 0; i < 3; ++i) {
    answer_.set_coordinates(i, 0);
  }
  EXPECT_TRUE(Locate({.allow_outside = true}).ok());
}

TEST_F(HostileLocate, VerticesAreOfTheMesh) {
  answer_.set_vertices(1, 7);
  ExpectDamaged(Locate().status(), "points[0] is at vertex 7 of 7");
}

TEST_F(HostileLocate, CoordinatesAreBarycentric) {
  for (const double coordinate : {kNan, -0.5, 1.5, kInfinity}) {
    answer_.set_coordinates(2, coordinate);
    ExpectDamaged(Locate().status(), "points[0] has the barycentric coordinate");
  }
}

TEST_F(HostileLocate, TheMeshIsTheOneThatWasAskedFor) {
  ExpectDamaged(Locate({.revision = 8}).status(), "the mesh of revision 9, not 8");
  answer_.set_revision(0);
  ExpectDamaged(Locate().status(), "the mesh of revision 0");
}

TEST_F(HostileLocate, NoPointIsOutsideUnlessThatIsAllowed) {
  answer_.set_simplices(0, kNoSimplex);
  ExpectDamaged(Locate().status(), "in no simplex, which was not allowed");
  ExpectDamaged(Locate({.allow_outside = true}).status(), "barycentric coordinate 0.5");
}

// A request without vertices would ask about all.
TEST(HostileServer, AnswersAboutDistancesAreThoseThatWereAskedFor) {
  FakeServer server;
  std::vector<v1::ApproximateNearestNeighborsRequest> requests;
  std::vector<double> distances = {1, 2};
  grpc::Status end = Broken();
  server.queries.nearest = [&](grpc::ServerContext&, const v1::ApproximateNearestNeighborsRequest& request,
                               auto& writer) {
    requests.push_back(request);
    v1::ApproximateNearestNeighborsResponse response;
    response.mutable_distances()->Assign(distances.begin(), distances.end());
    writer.Write(response);
    return end;
  };
  std::vector<double> told;
  const std::vector<uint32_t> vertices = {7, 8};
  const auto ask = [&](std::span<const uint32_t> about) {
    return server.Client().ApproximateNearestNeighbors(kSession, about, [&told](std::span<const double> found) {
      told.insert(told.end(), found.begin(), found.end());
      return absl::OkStatus();
    });
  };
  EXPECT_TRUE(ask(vertices).ok()) << "a connection that breaks after the last answer costs nothing";
  EXPECT_THAT(told, ElementsAre(1, 2));
  EXPECT_THAT(requests, SizeIs(1));
  end = grpc::Status::OK;
  distances = {1, 2, 3};
  ExpectDamaged(ask(vertices), "more than 2 vertices");
  distances = {1};
  ExpectDamaged(ask(vertices), "1 of 2 vertices");
  for (const double distance : {kNan, -1.0}) {
    distances = {1, distance};
    ExpectDamaged(ask(vertices), "negative or not a number");
    ExpectDamaged(ask({}), "negative or not a number");
  }
}

TEST(HostileServer, CellsHaveNumbers) {
  FakeServer server;
  double node = kNan;
  double radius = 1;
  server.queries.cells = [&](grpc::ServerContext&, const auto&, auto& writer) {
    v1::VoronoiCellsResponse response;
    v1::VoronoiCellBatch& cells = *response.mutable_cells();
    cells.add_vertices(0);
    cells.add_clip_radii(radius);
    cells.add_is_clipped(false);
    cells.add_node_counts(1);
    cells.add_nodes(0.5);
    cells.add_nodes(node);
    cells.add_neighbour_counts(0);
    writer.Write(response);
    return grpc::Status::OK;
  };
  const std::vector<uint32_t> vertices = {0};
  const auto ask = [&] {
    return server.Client().VoronoiCells(kSession, vertices, [](const CellBatch&) { return absl::OkStatus(); });
  };
  ExpectDamaged(ask(), "is not a number");
  node = 0.5;
  radius = kNan;
  ExpectDamaged(ask(), "is not a number");
  radius = kInfinity;
  EXPECT_TRUE(ask().ok());
}

TEST(HostileServer, AddedVerticesAreAsManyAsThePoints) {
  FakeServer server;
  int count = 0;
  server.queries.add = [&count](const auto&, v1::AddVerticesResponse& response) {
    for (int i = 0; i < count; ++i) {
      response.add_vertices(i);
    }
    return grpc::Status::OK;
  };
  const std::vector<double> points = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const std::vector<uint32_t> near = {0, 0, 0};
  for (const int wrong : {0, 4, 5, 7}) {
    count = wrong;
    ExpectDamaged(server.Client().AddVertices(kSession, points).status(), "vertices for points of 6 coordinates");
  }
  count = 2;
  ExpectDamaged(server.Client().AddVertices(kSession, points, near).status(), "2 vertices for points");
  count = 3;
  EXPECT_TRUE(server.Client().AddVertices(kSession, points, near).ok());
}

TEST(HostileServer, SessionsHaveADimensionThatThereIs) {
  FakeServer server;
  int dimension = 0;
  server.sessions.get = [&dimension](const auto&, v1::GetSessionResponse& response) {
    response.mutable_session()->mutable_parameters()->set_dimension(dimension);
    return grpc::Status::OK;
  };
  for (const int wrong : {-1, 65, std::numeric_limits<int>::max()}) {
    dimension = wrong;
    ExpectDamaged(server.Client().GetSession(kSession).status(), "a session in " + std::to_string(wrong) + "-D");
  }
}

TEST(HostileServer, PagesEnd) {
  FakeServer server;
  server.sessions.list = [](const auto&, v1::ListSessionsResponse& response) {
    response.set_next_page_token("again");
    return grpc::Status::OK;
  };
  server.operations.list = [](const auto&, v1::ListOperationsResponse& response) {
    response.set_next_page_token("again");
    return grpc::Status::OK;
  };
  EXPECT_TRUE(server.Client().ListSessions().ok());
  ExpectDamaged(server.Client().ListSessions({}, {.page_token = "again"}).status(), "the same page again");
  ExpectDamaged(server.Client().ListOperations(kSession, {.page_token = "again"}).status(), "the same page again");
}

TEST(HostileServer, MessagesDoNotReachTheTerminalAsCommands) {
  FakeServer server;
  server.sessions.get = [](const auto&, auto&) {
    return MakeError(grpc::StatusCode::NOT_FOUND, "no \x1b[2Jsession\r\n\xff\xc2\x9b \xc3\xa9", "ERROR_REASON_ANY");
  };
  const absl::Status status = server.Client().GetSession(kSession).status();
  EXPECT_EQ(status.message(), "no \\x1b[2Jsession\\x0d\\x0a\\xff\\xc2\\x9b \xc3\xa9");
  EXPECT_EQ(ReasonOf(status), "ERROR_REASON_ANY");
  server.operations.get = [](const auto&, v1::GetOperationResponse& response) {
    response.mutable_operation()->mutable_error()->set_code(13);
    response.mutable_operation()->mutable_error()->set_message("\x1b]0;title\x07");
    return grpc::Status::OK;
  };
  EXPECT_EQ(server.Client().GetOperation("sessions/one/operations/two")->error.message(), "\\x1b]0;title\\x07");
}

TEST(Printable, LeavesTextAloneAndEscapesTheRest) {
  for (const std::string text : {"", "plain", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x90\x84", "\xc2\xa0"}) {
    EXPECT_EQ(Printable(text), text);
  }
  EXPECT_EQ(Printable(std::string("\0\t\n\x1b\x7f", 5)), "\\x00\\x09\\x0a\\x1b\\x7f");
  EXPECT_EQ(Printable("\xc2\x80\xc2\x9f"), "\\xc2\\x80\\xc2\\x9f") << "control characters of Latin-1";
  // Continuations without a begin, begins without an end, too long forms, surrogates, beyond Unicode.
  for (const std::string text : {"\x80", "\xc3", "\xe2\x82", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80",
                                 "\xf0\x80\x80\x80", "\xf4\x90\x80\x80", "\xff"}) {
    const std::string printable = Printable(text);
    EXPECT_EQ(printable.size(), 4 * text.size()) << printable;
    EXPECT_EQ(Printable(printable), printable);
  }
}

}  // namespace
}  // namespace wellspace::client
