// The limit of memory of the real program, for every kind of input: it never holds more, whatever is sent.
#include <cmath>
#include <iostream>
#include <memory>
#include <numbers>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "client/client.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kMaxMemoryBytes = uint64_t{192} << 20;
// Code, threads, and unused parts of the pages of arrays.
constexpr double kRoom = 1.1;

// A server with the limit, whose work is done or refused; in a folder, or in memory.
class Limited {
 public:
  explicit Limited(bool has_folder = false)
      : daemon_(has_folder
                    ? std::vector<std::string>{"--max-memory", absl::StrCat(kMaxMemoryBytes), "--log-level", "off",
                                               "--data", folder_.Path("data")}
                    : std::vector<std::string>{"--max-memory", absl::StrCat(kMaxMemoryBytes), "--log-level", "off"}) {}
  ~Limited() {
    const uint64_t peak = daemon_.process().PeakMemory();
    std::cout << "peak " << (peak >> 20) << " MB of " << (kMaxMemoryBytes >> 20) << "\n";
    EXPECT_LE(static_cast<double>(peak), kRoom * static_cast<double>(kMaxMemoryBytes));
    EXPECT_TRUE(MeshTriangle(daemon_.Client()).ok()) << "it is alive, and others are answered";
    daemon_.Stop();
  }

  client::Client client() { return daemon_.Client(); }

 private:
  TemporaryFolder folder_;
  Daemon daemon_;
};

// Expects a call to have one of the ends that the limit allows.
void ExpectDoneOrRefused(const absl::Status& status) {
  EXPECT_TRUE(status.ok() || absl::IsResourceExhausted(status) || absl::IsDeadlineExceeded(status)) << status;
}

client::CallOptions Patient() {
  client::CallOptions call;
  call.timeout = absl::Minutes(2);
  return call;
}

// A ring of so many points.
std::vector<double> Ring(size_t count) {
  std::vector<double> points;
  for (size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    points.insert(points.end(), {0.5 + 0.5 * std::cos(angle), 0.5 + 0.5 * std::sin(angle)});
  }
  return points;
}

client::Features RingSegments(size_t count) {
  client::Features features;
  features.faces = client::FaceRule::kHoles;
  for (uint32_t i = 0; i < count; ++i) {
    features.ends.insert(features.ends.end(), {i, (i + 1) % static_cast<uint32_t>(count)});
  }
  return features;
}

client::SizeSamples Sizes(size_t count) {
  client::SizeSamples samples;
  for (size_t i = 0; i < count; ++i) {
    samples.points.insert(samples.points.end(),
                          {static_cast<double>(i % 2000) / 2000, static_cast<double>(i / 2000) / 10'000});
    samples.sizes.push_back(1 + 1e-9 * static_cast<double>(i));
  }
  return samples;
}

client::SessionOptions UnitSquare() {
  client::SessionOptions options;
  options.parameters.dimension = 2;
  options.parameters.domain_low = {0, 0};
  options.parameters.domain_high = {1, 1};
  return options;
}

TEST(MemoryLimit, OfDomainsInOneCall) {
  constexpr size_t kSegments = 250'000;
  constexpr int kClients = 4;
  Limited limited;
  client::MeshOptions options;
  options.dimension = 2;
  options.features = std::make_shared<const client::Features>(RingSegments(kSegments));
  const std::vector<double> points = Ring(kSegments);
  std::vector<std::thread> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.emplace_back([&, client = limited.client()]() mutable {
      ExpectDoneOrRefused(client.MeshPoints(options, points, nullptr, Patient()).status());
      ExpectDoneOrRefused(client.EstimateMesh(options, points, Patient()).status());
    });
  }
  for (std::thread& client : clients) {
    client.join();
  }
}

TEST(MemoryLimit, OfSizesInOneCall) {
  Limited limited;
  client::MeshOptions options = UnitSquare().parameters;
  options.size_samples = std::make_shared<const client::SizeSamples>(Sizes(4'000'000));
  ExpectDoneOrRefused(limited.client().MeshPoints(options, {}, nullptr, Patient()).status());
}

class MemoryLimitOfSessions : public ::testing::TestWithParam<bool> {};

INSTANTIATE_TEST_SUITE_P(Folder, MemoryLimitOfSessions, ::testing::Bool());

TEST_P(MemoryLimitOfSessions, SizesThatReplaceOthers) {
  Limited limited(GetParam());
  client::Client client = limited.client();
  const absl::StatusOr<client::Session> session = client.CreateSession(UnitSquare());
  ASSERT_TRUE(session.ok()) << session.status();
  client::SizeSamples samples = Sizes(4'000'000);
  for (int i = 0; i < 3; ++i) {
    samples.sizes[0] += 1;
    ExpectDoneOrRefused(client.SetSizes(session->name, samples, Patient()).status());
  }
  samples.points.resize(2'000'000);
  samples.sizes.resize(1'000'000);
  for (int i = 0; i < 3; ++i) {
    samples.sizes[0] += 1;
    EXPECT_TRUE(client.SetSizes(session->name, samples, Patient()).ok());
  }
  const absl::StatusOr<client::Operation> refinement = client.StartRefinement(session->name);
  ASSERT_TRUE(refinement.ok()) << refinement.status();
  EXPECT_TRUE(client.WatchOperation(refinement->name).ok());
}

TEST_P(MemoryLimitOfSessions, SegmentsAndPointsThatAreRemovedAndAdded) {
  constexpr size_t kSegments = 400'000;
  Limited limited(GetParam());
  client::Client client = limited.client();
  client::SessionOptions options;
  options.parameters.dimension = 2;
  const absl::StatusOr<client::Session> session = client.CreateSession(options);
  ASSERT_TRUE(session.ok()) << session.status();
  std::vector<double> points = Ring(kSegments);
  for (int i = 0; i < 600'000; ++i) {  // inside, of which some are taken out
    points.insert(points.end(), {0.3 + 0.4 * (i % 1000) / 1000, 0.3 + 0.4 * (i / 1000) / 600});
  }
  client::SpanSource source(2, points);
  ExpectDoneOrRefused(client.UploadPoints(session->name, source, std::nullopt, nullptr, Patient()).status());
  ExpectDoneOrRefused(client.AddSegments(session->name, RingSegments(kSegments), std::nullopt, Patient()).status());
  std::vector<uint64_t> removed(400'000);
  std::iota(removed.begin(), removed.end(), kSegments);
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&, own = limited.client()]() mutable {
      (void)own.RemovePoints(session->name, removed, Patient());  // one of them; the others meet other points
    });
  }
  for (std::thread& one : clients) {
    one.join();
  }
  const absl::StatusOr<client::Operation> refinement = client.StartRefinement(session->name, {}, Patient());
  if (refinement.ok()) {
    ASSERT_TRUE(client.WatchOperation(refinement->name, nullptr, std::nullopt, Patient()).ok());
  }
}

// A mesh of a few points to which many come.
TEST_P(MemoryLimitOfSessions, PointsThatComeToAMesh) {
  Limited limited(GetParam());
  client::Client client = limited.client();
  const absl::StatusOr<client::Session> session = client.CreateSession(UnitSquare());
  ASSERT_TRUE(session.ok()) << session.status();
  for (const int side : {10, 1400}) {
    std::vector<double> points;
    for (int i = 0; i < side * side; ++i) {
      points.insert(points.end(), {(0.5 + i % side) / side, (0.5 + static_cast<double>(i / side)) / side});
    }
    client::SpanSource source(2, points);
    ExpectDoneOrRefused(client.UploadPoints(session->name, source, std::nullopt, nullptr, Patient()).status());
    const absl::StatusOr<client::Operation> refinement = client.StartRefinement(session->name, {}, Patient());
    ASSERT_TRUE(refinement.ok()) << refinement.status();
    ASSERT_TRUE(client.WatchOperation(refinement->name, nullptr, std::nullopt, Patient()).ok());
  }
}

}  // namespace
}  // namespace wellspace::server
