// The state of a session: Apply of changes, once they are committed and once they are read again.
#include "server/sessions/session_state.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/meshers/meshing_version.h"
#include "gtest/gtest.h"
#include "server/sessions/session_changes.h"
#include "server/wire/errors.h"
#include "tests/server/service_harness.h"
#include "tests/server/store/store_support.h"
#include "tests/support/amount.h"
#include "tests/support/clouds.h"

namespace wellspace::server {
namespace {

// The log of one session, by rules that know nothing of the meaning of records.
class Log {
 public:
  void Commit(const SessionChange& change) {
    if (change.state.has_value()) {
      stored_.state = *change.state;
    }
    stored_.steps.insert(stored_.steps.end(), change.steps.begin(), change.steps.end());
    for (const store::v1::OperationRecord& operation : change.operations) {
      std::erase_if(stored_.operations, [&](const auto& kept) { return kept.number() == operation.number(); });
      stored_.operations.push_back(operation);
    }
    std::erase_if(stored_.operations, [&](const auto& kept) {
      return std::ranges::find(change.dropped_operations, kept.number()) != change.dropped_operations.end();
    });
    std::ranges::sort(stored_.operations, {}, [](const auto& operation) { return operation.number(); });
  }
  const StoredSession& stored() const { return stored_; }

 private:
  StoredSession stored_;
};

std::shared_ptr<const core::SizeSamples> Samples(size_t count) {
  return std::make_shared<const core::SizeSamples>(
      core::SizeSamples{.points = std::vector<double>(2 * count, 0.5), .sizes = std::vector<double>(count, 1)});
}

store::v1::MeshRecord MeshOf(uint64_t revision) {
  store::v1::MeshRecord mesh;
  mesh.set_revision(revision);
  mesh.set_vertices(10 * revision);
  for (const double low : {-1.0, -2.0}) {
    mesh.add_domain_low(low);
    mesh.add_domain_high(-low);
  }
  return mesh;
}

// A session that does what it is asked for, without stores and mesher: its state, and its log.
class Life {
 public:
  Life() {
    Make(CreationChange({.tenant = "a",
                         .name = "sessions/1",
                         .parameters = {.dimension = 2},
                         .labels = {{"key", "value"}},
                         .ttl = absl::Minutes(1),
                         .create_time = absl::FromUnixSeconds(1000)}));
  }

  const SessionState& state() const { return *state_; }
  const StoredSession& stored() const { return log_.stored(); }

  // Commits and applies. The state before stays unchanged.
  void Make(const SessionChange& change) {
    const std::shared_ptr<const SessionState> before = state_;
    const std::string text = TextOf(*before);
    absl::StatusOr<SessionState> after = Apply(*before, change);
    ASSERT_TRUE(after.ok()) << after.status();
    log_.Commit(change);
    state_ = std::make_shared<const SessionState>(*std::move(after));
    EXPECT_EQ(TextOf(*before), text) << "a state is a value";
  }

  void Upload(uint64_t count) { Make(PointsChange(state(), {.end = state().record.points() + count, .crc32c = 7})); }
  void SetSizes(size_t count) { Make(SizesChange(state(), count == 0 ? nullptr : Samples(count))); }
  void AddSegments(uint64_t count) {
    FeaturePart part;
    for (uint32_t i = 0; i < 2 * count; ++i) {
      part.mutable_segments()->add_ends(i);
    }
    Make(FeaturesChange(state(), part, {}, {.counts = Counts() + FeatureCounts{.segments = count}}));
  }
  // With a seed and the rule of holes.
  void AddTriangles(uint64_t count) {
    FeaturePart part;
    for (uint32_t i = 0; i < 3 * count; ++i) {
      part.mutable_triangles()->add_corners(i);
    }
    part.mutable_surface()->set_solids(v1::SOLID_RULE_HOLES);
    part.mutable_surface()->add_seeds()->set_region(4);
    FeatureSummary after{.counts = Counts() + FeatureCounts{.triangles = count, .seeds = 1}, .has_rules = true};
    after.surface.emplace().set_solids(v1::SOLID_RULE_HOLES);
    Make(FeaturesChange(state(), part, {}, after));
  }
  // Appends `count` points with the start, refines with `size`, and ends as `ends` says.
  void Refine(double size, bool restart, uint64_t count, bool succeeds = true) {
    core::MeshParameters parameters = *state().parameters;
    parameters.max_circumradius = size;
    store::v1::OperationRecord operation = NewOperation(state(), parameters, restart, absl::FromUnixSeconds(2000));
    Make(StartChange(state(), operation, {.end = state().record.points() + count, .crc32c = 8}));
    operation.set_state(v1::Operation::STATE_RUNNING);
    Make(OperationChange(state(), operation));
    operation.set_state(succeeds ? v1::Operation::STATE_SUCCEEDED : v1::Operation::STATE_FAILED);
    Make(succeeds ? SuccessChange(state(), operation, MeshOf(NextRevision(state())))
                  : OperationChange(state(), operation));
  }
  void AddVertices(uint64_t uploaded, uint64_t count) {
    Make(AdditionChange(state(), {.end = state().record.points() + count, .crc32c = 9},
                        state().steps.points() + uploaded, count));
  }
  void RemovePoints(uint64_t left) {
    store::v1::PointsFile file;
    file.set_number(NextRevision(state()));
    file.set_epoch(3);
    Make(RemovalChange(state(), {.points = left, .file = file, .crc32c = 5}));
  }
  // One of all these, drawn.
  void DoAnything(test::SplitMix64& random) {
    switch (random.Below(9)) {
      case 0:
        return Upload(1 + random.Below(9));
      case 1:
        return SetSizes(random.Below(4));
      case 2:
        return AddSegments(1 + random.Below(2));
      case 3:
        return Make(UpdateChange(state(),
                                 std::map<std::string, std::string>{{"drawn", std::to_string(random.Below(100))}},
                                 absl::Seconds(60)));
      case 4:
        return RemovePoints(state().record.points() / 2);
      case 5:
        return Refine(0.5 + random.Unit(), random.Below(3) == 0, random.Below(3), random.Below(4) != 0);
      case 6:
        return AddTriangles(1 + random.Below(2));
      default:
        return state().steps.empty() ? Refine(1, false, 1)
                                     : AddVertices(state().record.points() - state().steps.points(), random.Below(3));
    }
  }

 private:
  FeatureCounts Counts() const {
    const store::v1::SessionRecord& record = state().record;
    return {.segments = record.segments(), .triangles = record.triangles(), .seeds = record.seeds()};
  }

  std::shared_ptr<const SessionState> state_ = std::make_shared<const SessionState>();
  Log log_;
};

// The text of a state that another process cannot know: at which revision the last sizes went.
std::string TextAfterRestart(SessionState state) {
  state.sizes_revision = state.sizes().number;
  return TextOf(state);
}

TEST(SessionState, IsTheSameOnceItIsReadAgain) {
  const int lives = test::Amount("WELLSPACE_LIVES", 50);
  for (int seed = 0; seed < lives; ++seed) {
    test::SplitMix64 random(seed);
    Life life;
    for (int i = 0; i < 60; ++i) {
      life.DoAnything(random);
      const absl::StatusOr<SessionState> read = StateOf(life.stored());
      ASSERT_TRUE(read.ok()) << read.status();
      ASSERT_EQ(TextAfterRestart(*read), TextAfterRestart(life.state())) << "seed " << seed << ", change " << i;
    }
  }
}

TEST(SessionState, ThePlacesOfPointsAreInOrder) {
  test::SplitMix64 random(5);
  Life life;
  for (int i = 0; i < 500; ++i) {
    const uint64_t revision = life.state().record.revision();
    life.DoAnything(random);
    const SessionState& state = life.state();
    EXPECT_GE(state.record.revision(), revision);
    EXPECT_LE(state.steps.points(), state.record.points());
    uint64_t end = 0;
    for (const SessionStep& step : state.steps.all()) {
      EXPECT_LE(end, step.uploads_end);
      EXPECT_LE(step.uploads_end, step.end);
      end = step.end;
    }
    EXPECT_EQ(end, state.steps.points());
  }
}

TEST(SessionState, NoStepNeedsASetThatWasDropped) {
  test::SplitMix64 random(6);
  Life life;
  std::vector<uint64_t> sets;
  for (int i = 0; i < 500; ++i) {
    const SessionState before = life.state();
    const size_t steps = life.stored().steps.size();
    life.DoAnything(random);
    std::vector<SizesInUse> wanted = life.state().steps.sizes();
    if (life.state().sizes().number != 0) {
      wanted.push_back(life.state().sizes());
    }
    for (const SizesInUse& set : UnusedSizes(before, life.state().steps, life.state().sizes().number)) {
      EXPECT_EQ(std::ranges::find(wanted, set), wanted.end()) << steps;
    }
  }
}

TEST(SessionState, ASetOfSizesIsKeptForTheStepsThatHadIt) {
  Life life;
  life.Upload(9);
  life.SetSizes(2);
  const SizesInUse first = life.state().sizes();
  EXPECT_EQ(first, (SizesInUse{.number = life.state().record.revision(), .count = 2}));
  life.Refine(1, false, 0);
  const SessionChange other = SizesChange(life.state(), Samples(3));
  EXPECT_TRUE(other.dropped_sizes.empty()) << "Replay needs them";
  life.Make(other);
  store::v1::OperationRecord restart = NewOperation(life.state(), *life.state().parameters, true, absl::Now());
  const SessionChange success = SuccessChange(life.state(), restart, MeshOf(100));
  EXPECT_EQ(success.dropped_sizes, std::vector<uint64_t>{first.number});
}

TEST(SessionState, SizesThatAreSetAgainKnowTheirRevision) {
  Life life;
  const uint64_t revision = life.state().record.revision();
  EXPECT_FALSE(IsRevisionOfSizes(life.state(), revision));
  life.SetSizes(1);
  EXPECT_TRUE(IsRevisionOfSizes(life.state(), revision));
  EXPECT_FALSE(IsRevisionOfSizes(life.state(), revision + 1));
  life.SetSizes(0);
  EXPECT_TRUE(IsRevisionOfSizes(life.state(), revision + 1)) << "also where they went";
}

TEST(SessionState, ARefinementThatDoesNotSucceedIsNoStep) {
  Life life;
  life.Upload(9);
  life.Refine(1, false, 0);
  const std::string steps = TextOf(SessionState{.record = life.state().record, .steps = life.state().steps});
  life.Refine(0.5, true, 0, /*succeeds=*/false);
  store::v1::SessionRecord record = life.state().record;
  record.set_next_operation(record.next_operation() - 1);
  EXPECT_EQ(TextOf(SessionState{.record = record, .steps = life.state().steps}), steps);
  EXPECT_EQ(life.state().operations.size(), 2u);
}

TEST(SessionState, OfManyOperationsTheLastAreKept) {
  Life life;
  for (int i = 0; i < 150; ++i) {
    life.Refine(1, false, 1);
  }
  ASSERT_EQ(life.state().operations.size(), kKeptOperations);
  EXPECT_EQ(life.state().operations.front()->number(), 51u);
  EXPECT_EQ(RecordOfOperation(life.state(), 77)->number(), 77u);
  EXPECT_EQ(life.stored().operations.size(), kKeptOperations);
}

TEST(SessionState, WhatAnotherVersionHasMadeIsNoStepAndNeitherIsWhatFollows) {
  Life life;
  life.Upload(9);
  life.Refine(1, false, 0);
  StoredSession stored = life.stored();
  stored.steps.back().mutable_refined()->set_meshing_version(core::kMeshingVersion + 1);
  store::v1::StepRecord& added = stored.steps.emplace_back();
  added.mutable_added()->set_uploads_end(9);
  added.mutable_added()->set_end(9);
  const SessionState state = StateOf(stored).value();
  EXPECT_TRUE(state.steps.empty());
  EXPECT_TRUE(CheckMesh(state).ok());
  EXPECT_EQ(DetailsOf(CheckSteps(state)).reason, "MESH_NOT_READY");
  EXPECT_NE(state.structure_version, 0u);
}

TEST(SessionState, PointsThatAreRemovedTakeTheStructureWithThem) {
  Life life;
  life.Upload(9);
  life.Refine(1, false, 0);
  const uint64_t version = life.state().structure_version;
  EXPECT_TRUE(CheckStructure(life.state(), true).ok());
  EXPECT_EQ(DetailsOf(CheckStructure(life.state(), false)).reason, "MESH_NOT_READY");
  life.RemovePoints(4);
  EXPECT_NE(life.state().structure_version, version);
  EXPECT_EQ(DetailsOf(CheckSteps(life.state())).reason, "MESH_NOT_READY");
  EXPECT_EQ(PointsOf(life.stored().steps).size(), 1u);
  EXPECT_EQ(BoxOf(life.state()).low[1], -2) << "that of the mesh, which stays";
}

TEST(SessionState, AppendedPointsMakeTheNextRevision) {
  Life life;
  const uint64_t revision = life.state().record.revision();
  EXPECT_TRUE(CheckRevision(life.state(), 0, revision).ok());
  EXPECT_TRUE(CheckRevision(life.state(), 0, 0).ok());
  EXPECT_EQ(DetailsOf(CheckRevision(life.state(), 3, revision)).reason, "REVISION_MISMATCH");
  EXPECT_TRUE(CheckRevision(life.state(), 3, revision + 1).ok());
  life.Upload(3);
  EXPECT_EQ(life.state().record.revision(), revision + 1);
  EXPECT_FALSE(life.state().record.is_ready());
}

TEST(SessionState, ParametersThatAreNotKnownAreRefused) {
  StoredSession stored = Life().stored();
  stored.state.mutable_parameters()->set_dimension(99);
  EXPECT_EQ(DetailsOf(StateOf(stored).status()).reason, "INVALID_PARAMETERS");
}

TEST(SessionState, ADeletedSessionSaysSo) {
  Life life;
  EXPECT_TRUE(Apply(life.state(), DeletionChange(life.state()))->is_deleted);
}

TEST(SessionSteps, CopiesAreValues) {
  const auto parameters = std::make_shared<const core::MeshParameters>(core::MeshParameters{.dimension = 2});
  SessionSteps steps;
  EXPECT_EQ(steps.points(), 0u);
  steps.NoteRefinement(10, parameters, {});
  std::vector<SessionSteps> copies;
  for (uint64_t i = 0; i < 1000; ++i) {
    copies.push_back(steps);
    steps.NoteAddition(10 + i, 11 + i);
    ASSERT_EQ(steps.count(), i + 2);
    ASSERT_EQ(steps.points(), 11 + i);
  }
  for (uint64_t i = 0; i < 1000; ++i) {
    ASSERT_EQ(copies[i].count(), i + 1);
    ASSERT_EQ(copies[i].points(), 10 + i);
    ASSERT_EQ(copies[i].all().size(), i + 1);
    ASSERT_EQ(copies[i].all().back().end, 10 + i);
  }
}

}  // namespace
}  // namespace wellspace::server
