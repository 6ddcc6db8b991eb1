// Parameters and points of requests: defaults, limits, and errors that name the field.
#include "server/wire/convert.h"

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "google/protobuf/unknown_field_set.h"
#include "gtest/gtest.h"
#include "server/services/meshing/cloud_receiver.h"
#include "server/wire/errors.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

ServiceOptions SmallLimits() {
  ServiceOptions options;
  options.max_points = 10;
  options.max_vertices = 1000;
  options.max_threads = 2;
  return options;
}

// A box from `low` to `high` on each of three axes.
v1::SizeBox& AddSizeBox(v1::MeshParameters& parameters, double low, double high, double max_circumradius) {
  v1::SizeBox& box = *parameters.add_size_boxes();
  for (int axis = 0; axis < 3; ++axis) {
    box.add_low(low);
    box.add_high(high);
  }
  box.set_max_circumradius(max_circumradius);
  return box;
}

TEST(ParametersFromProto, FillsInDefaults) {
  v1::MeshParameters message;
  message.set_dimension(2);
  const absl::StatusOr<core::MeshParameters> parameters = ParametersFromProto(message, SmallLimits());
  ASSERT_TRUE(parameters.ok());
  EXPECT_EQ(parameters->dimension, 2);
  EXPECT_EQ(parameters->rho, 0);
  EXPECT_EQ(parameters->margin, core::MeshParameters().margin);
  EXPECT_TRUE(parameters->domain_low.empty());
  EXPECT_EQ(parameters->threads, 1);
  EXPECT_EQ(parameters->max_vertices, 1000u);
  EXPECT_EQ(parameters->criterion, core::Criterion::kRadiusEdge);
  EXPECT_EQ(parameters->max_circumradius, 0);
  EXPECT_TRUE(parameters->size_boxes.empty());
  EXPECT_EQ(parameters->edge_length, 0);
  EXPECT_EQ(parameters->gradation, 0);
  EXPECT_FALSE(parameters->min_dihedral.has_value());
  EXPECT_FALSE(parameters->pump_weights);
  EXPECT_EQ(parameters->merge_distance, 0);
  EXPECT_FALSE(parameters->keep_vertices);
}

TEST(ParametersFromProto, TakesEveryField) {
  v1::MeshParameters message = UnitCubeParameters();
  message.set_rho(2.5);
  message.set_margin(0.5);
  message.set_max_vertices(77);
  message.set_threads(2);
  message.set_criterion(v1::CRITERION_WELL_SPACED);
  message.set_max_circumradius(0.5);
  AddSizeBox(message, 0.25, 0.75, 0.125);
  AddSizeBox(message, -1, 2, 0.25);
  message.set_edge_length(0.375);
  message.set_gradation(0.25);
  message.set_min_dihedral(0);
  message.set_pump_weights(true);
  message.set_merge_distance(1e-9);
  message.set_keep_vertices(true);
  const absl::StatusOr<core::MeshParameters> parameters = ParametersFromProto(message, SmallLimits());
  ASSERT_TRUE(parameters.ok());
  EXPECT_EQ(parameters->rho, 2.5);
  EXPECT_EQ(parameters->margin, 0.5);
  EXPECT_THAT(parameters->domain_low, ElementsAre(0, 0, 0));
  EXPECT_THAT(parameters->domain_high, ElementsAre(1, 1, 1));
  EXPECT_EQ(parameters->max_vertices, 77u);
  EXPECT_EQ(parameters->threads, 2);
  EXPECT_EQ(parameters->criterion, core::Criterion::kWellSpaced);
  EXPECT_EQ(parameters->max_circumradius, 0.5);
  ASSERT_EQ(parameters->size_boxes.size(), 2u);
  EXPECT_THAT(parameters->size_boxes[0].low, ElementsAre(0.25, 0.25, 0.25));
  EXPECT_THAT(parameters->size_boxes[0].high, ElementsAre(0.75, 0.75, 0.75));
  EXPECT_EQ(parameters->size_boxes[0].max_circumradius, 0.125);
  EXPECT_EQ(parameters->size_boxes[1].max_circumradius, 0.25);
  EXPECT_EQ(parameters->edge_length, 0.375);
  EXPECT_EQ(ParametersToProto(*parameters).edge_length(), 0.375);
  EXPECT_EQ(parameters->gradation, 0.25);
  EXPECT_EQ(ParametersToProto(*parameters).gradation(), 0.25);
  EXPECT_EQ(parameters->min_dihedral, 0.0);
  EXPECT_TRUE(parameters->pump_weights);
  EXPECT_EQ(parameters->merge_distance, 1e-9);
  EXPECT_EQ(ParametersToProto(*parameters).merge_distance(), 1e-9);
  EXPECT_TRUE(parameters->keep_vertices);
}

TEST(ParametersFromProto, TakesPeriodicAxesInAnyOrder) {
  v1::MeshParameters message = UnitCubeParameters();
  message.add_periodic_axes(2);
  message.add_periodic_axes(0);
  const absl::StatusOr<core::MeshParameters> parameters = ParametersFromProto(message, SmallLimits());
  ASSERT_TRUE(parameters.ok()) << parameters.status();
  EXPECT_THAT(parameters->periodic_axes, ElementsAre(0, 2));
  EXPECT_THAT(ParametersToProto(*parameters).periodic_axes(), ElementsAre(0, 2));
  message.add_periodic_axes(3);
  EXPECT_EQ(ParametersFromProto(message, SmallLimits()).status().message(),
            "periodic_axes[2]: 3 is no axis in 3-D; 0 to 2 are");
  message.mutable_periodic_axes()->RemoveLast();
  message.set_pump_weights(true);
  EXPECT_THAT(std::string(ParametersFromProto(message, SmallLimits()).status().message()),
              testing::HasSubstr("not allowed with periodic_axes"));
}

// An option that is not sent has its default; a session's own parameters can be sent as they are.
TEST(ParametersFromProto, TellsAZeroFromNothing) {
  v1::MeshParameters message = UnitCubeParameters();
  message.set_gradation(0);
  EXPECT_EQ(ParametersFromProto(message, SmallLimits()).status().message(),
            "gradation: 0 is not allowed; expected a number above 0 and at most 1, or nothing for the default");
  // An older client, which sends no 0, and an empty field on the wire are the same.
  v1::MeshParameters older = UnitCubeParameters();
  ASSERT_TRUE(older.ParseFromString(UnitCubeParameters().SerializeAsString()));
  EXPECT_FALSE(older.has_gradation() || older.has_rho() || older.has_max_vertices() || older.has_threads());
  const absl::StatusOr<core::MeshParameters> parameters = ParametersFromProto(older, SmallLimits());
  ASSERT_TRUE(parameters.ok()) << parameters.status();
  const v1::MeshParameters told = ParametersToProto(*parameters);
  EXPECT_FALSE(told.has_max_circumradius() || told.has_edge_length() || told.has_gradation());
  EXPECT_TRUE(ParametersFromProto(told, SmallLimits()).ok());
  // Equal points alone: here 0 is a value.
  message.clear_gradation();
  message.set_merge_distance(0);
  EXPECT_TRUE(ParametersFromProto(message, SmallLimits()).ok());
}

TEST(ParametersFromProto, EveryDimensionHasItsDefaults) {
  for (int dimension = core::kMinDimension; dimension <= core::kMaxDimension; ++dimension) {
    v1::MeshParameters message = UnitCubeParameters(dimension);
    const absl::StatusOr<core::MeshParameters> parameters = ParametersFromProto(message, SmallLimits());
    ASSERT_TRUE(parameters.ok()) << dimension;
    message.set_rho(core::MinimumRho(dimension));
    EXPECT_TRUE(ParametersFromProto(message, SmallLimits()).ok()) << dimension;
    message.set_rho(core::MinimumRho(dimension) * 0.999);
    EXPECT_EQ(DetailsOf(ParametersFromProto(message, SmallLimits()).status()).field, "parameters.rho") << dimension;
  }
}

TEST(ParametersFromProto, TakesFewerThreadsThanAskedFor) {
  v1::MeshParameters message = UnitCubeParameters();
  message.set_threads(64);
  const absl::StatusOr<core::MeshParameters> parameters = ParametersFromProto(message, SmallLimits());
  ASSERT_TRUE(parameters.ok());
  EXPECT_EQ(parameters->threads, 2);
}

struct BadParameters {
  std::string name;
  std::string field;
  std::function<void(v1::MeshParameters&)> spoil;
};

class ParametersFromProtoRefuses : public ::testing::TestWithParam<BadParameters> {};

TEST_P(ParametersFromProtoRefuses, NamingTheField) {
  v1::MeshParameters message = UnitCubeParameters();
  GetParam().spoil(message);
  const grpc::Status status = ToGrpcStatus(ParametersFromProto(message, SmallLimits()).status());
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  const ErrorDetails details = DetailsOf(status);
  EXPECT_EQ(details.reason, "INVALID_PARAMETERS");
  EXPECT_EQ(details.field, GetParam().field) << status.error_message();
  EXPECT_FALSE(details.may_retry);
  EXPECT_FALSE(status.error_message().empty());
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

INSTANTIATE_TEST_SUITE_P(
    All, ParametersFromProtoRefuses,
    ::testing::Values(
        BadParameters{"DimensionZero", "parameters.dimension", [](auto& p) { p.set_dimension(0); }},
        BadParameters{"DimensionOne", "parameters.dimension", [](auto& p) { p.set_dimension(1); }},
        BadParameters{"DimensionNegative", "parameters.dimension", [](auto& p) { p.set_dimension(-3); }},
        BadParameters{"DimensionHuge", "parameters.dimension", [](auto& p) { p.set_dimension(1 << 30); }},
        BadParameters{"RhoZero", "parameters.rho", [](auto& p) { p.set_rho(0); }},
        BadParameters{"MaxVerticesZero", "parameters.max_vertices", [](auto& p) { p.set_max_vertices(0); }},
        BadParameters{"ThreadsZero", "parameters.threads", [](auto& p) { p.set_threads(0); }},
        BadParameters{"CircumradiusZero", "parameters.max_circumradius", [](auto& p) { p.set_max_circumradius(0); }},
        BadParameters{"EdgeLengthZero", "parameters.edge_length", [](auto& p) { p.set_edge_length(0); }},
        BadParameters{"GradationZero", "parameters.gradation", [](auto& p) { p.set_gradation(-0.0); }},
        BadParameters{"RhoSmall", "parameters.rho", [](auto& p) { p.set_rho(0.5); }},
        BadParameters{"RhoNegative", "parameters.rho", [](auto& p) { p.set_rho(-2); }},
        BadParameters{"RhoNan", "parameters.rho", [](auto& p) { p.set_rho(std::nan("")); }},
        BadParameters{"MinDihedralNegative", "parameters.min_dihedral", [](auto& p) { p.set_min_dihedral(-1); }},
        BadParameters{"MinDihedralNan", "parameters.min_dihedral", [](auto& p) { p.set_min_dihedral(std::nan("")); }},
        BadParameters{"MinDihedralLarge", "parameters.min_dihedral", [](auto& p) { p.set_min_dihedral(18.01); }},
        BadParameters{"MinDihedralIn2D", "parameters.min_dihedral",
                      [](auto& p) {
                        p = UnitCubeParameters(2);
                        p.set_min_dihedral(12);
                      }},
        BadParameters{"MinDihedralIn4D", "parameters.min_dihedral",
                      [](auto& p) {
                        p = UnitCubeParameters(4);
                        p.set_min_dihedral(12);
                      }},
        BadParameters{"PumpWeightsIn2D", "parameters.pump_weights",
                      [](auto& p) {
                        p = UnitCubeParameters(2);
                        p.set_pump_weights(true);
                      }},
        BadParameters{"MergeDistanceNegative", "parameters.merge_distance", [](auto& p) { p.set_merge_distance(-1); }},
        BadParameters{"MergeDistanceNan", "parameters.merge_distance",
                      [](auto& p) { p.set_merge_distance(std::nan("")); }},
        BadParameters{"MarginNegative", "parameters.margin", [](auto& p) { p.set_margin(-0.5); }},
        BadParameters{"MarginNan", "parameters.margin", [](auto& p) { p.set_margin(std::nan("")); }},
        BadParameters{"MarginInfinite", "parameters.margin", [](auto& p) { p.set_margin(kInfinity); }},
        BadParameters{"DomainEmpty", "parameters.domain", [](auto& p) { p.mutable_domain()->Clear(); }},
        BadParameters{"DomainWithoutHigh", "parameters.domain", [](auto& p) { p.mutable_domain()->clear_high(); }},
        BadParameters{"DomainShort", "parameters.domain",
                      [](auto& p) { p.mutable_domain()->mutable_low()->RemoveLast(); }},
        BadParameters{"DomainLong", "parameters.domain",
                      [](auto& p) {
                        p.mutable_domain()->add_low(0);
                        p.mutable_domain()->add_high(1);
                      }},
        BadParameters{"DomainFlat", "parameters.domain", [](auto& p) { p.mutable_domain()->set_high(1, 0); }},
        BadParameters{"DomainInverted", "parameters.domain", [](auto& p) { p.mutable_domain()->set_high(1, -1); }},
        BadParameters{"DomainNan", "parameters.domain", [](auto& p) { p.mutable_domain()->set_low(2, std::nan("")); }},
        BadParameters{"DomainInfinite", "parameters.domain",
                      [](auto& p) { p.mutable_domain()->set_high(0, kInfinity); }},
        BadParameters{"DimensionSeven", "parameters.dimension", [](auto& p) { p.set_dimension(7); }},
        BadParameters{"CriterionUnknown", "parameters.criterion",
                      [](auto& p) { p.set_criterion(static_cast<v1::Criterion>(3)); }},
        BadParameters{"CircumradiusNegative", "parameters.max_circumradius",
                      [](auto& p) { p.set_max_circumradius(-1); }},
        BadParameters{"CircumradiusNan", "parameters.max_circumradius",
                      [](auto& p) { p.set_max_circumradius(std::nan("")); }},
        BadParameters{"CircumradiusInfinite", "parameters.max_circumradius",
                      [](auto& p) { p.set_max_circumradius(kInfinity); }},
        BadParameters{"EdgeLengthNegative", "parameters.edge_length", [](auto& p) { p.set_edge_length(-1); }},
        BadParameters{"EdgeLengthNan", "parameters.edge_length", [](auto& p) { p.set_edge_length(std::nan("")); }},
        BadParameters{"GradationAboveOne", "parameters.gradation", [](auto& p) { p.set_gradation(1.5); }},
        BadParameters{"GradationNan", "parameters.gradation", [](auto& p) { p.set_gradation(std::nan("")); }},
        BadParameters{"SizeBoxInverted", "parameters.size_boxes[2].high[1]",
                      [](auto& p) {
                        AddSizeBox(p, 0, 1, 0.5);
                        AddSizeBox(p, 0, 1, 0.5);
                        AddSizeBox(p, 0, 1, 0.5).set_high(1, -0.5);
                      }},
        BadParameters{"SizeBoxNan", "parameters.size_boxes[0].low[2]",
                      [](auto& p) { AddSizeBox(p, 0, 1, 0.5).set_low(2, std::nan("")); }},
        BadParameters{"SizeBoxInfinite", "parameters.size_boxes[0].high[0]",
                      [](auto& p) { AddSizeBox(p, 0, 1, 0.5).set_high(0, kInfinity); }},
        BadParameters{"SizeBoxShort", "parameters.size_boxes[0].low",
                      [](auto& p) { AddSizeBox(p, 0, 1, 0.5).mutable_low()->RemoveLast(); }},
        BadParameters{"SizeBoxLong", "parameters.size_boxes[1].high",
                      [](auto& p) {
                        AddSizeBox(p, 0, 1, 0.5);
                        AddSizeBox(p, 0, 1, 0.5).add_high(1);
                      }},
        BadParameters{"SizeBoxWithoutSize", "parameters.size_boxes[0].max_circumradius",
                      [](auto& p) { AddSizeBox(p, 0, 1, 0); }},
        BadParameters{"SizeBoxSizeNan", "parameters.size_boxes[0].max_circumradius",
                      [](auto& p) { AddSizeBox(p, 0, 1, std::nan("")); }},
        BadParameters{"ThreadsNegative", "parameters.threads", [](auto& p) { p.set_threads(-1); }},
        BadParameters{"MaxVerticesAboveTheServers", "parameters.max_vertices",
                      [](auto& p) { p.set_max_vertices(1001); }}),
    [](const auto& test) { return test.param.name; });

v1::MeshPointsRequest ParametersRequest() {
  v1::MeshPointsRequest request;
  *request.mutable_parameters() = UnitCubeParameters();
  return request;
}

v1::MeshPointsRequest PointsRequest(const std::vector<double>& coordinates) {
  v1::MeshPointsRequest request;
  request.mutable_points()->mutable_coordinates()->Assign(coordinates.begin(), coordinates.end());
  return request;
}

// The answer of `receiver` to `request`.
grpc::Status Accept(CloudReceiver& receiver, v1::MeshPointsRequest request) {
  return ToGrpcStatus(receiver.Accept(&request));
}

TEST(CloudReceiver, CollectsChunksInOrder) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  EXPECT_FALSE(receiver.has_parameters());
  ASSERT_TRUE(Accept(receiver, ParametersRequest()).ok());
  EXPECT_TRUE(receiver.has_parameters());
  ASSERT_TRUE(Accept(receiver, PointsRequest({1, 2, 3})).ok());
  ASSERT_TRUE(Accept(receiver, PointsRequest({})).ok());
  ASSERT_TRUE(Accept(receiver, PointsRequest({4, 5, 6, 7, 8, 9})).ok());
  ASSERT_TRUE(receiver.AcceptEnd().ok());
  EXPECT_EQ(receiver.point_count(), 3u);
  NumberChunks points = receiver.TakePoints();
  EXPECT_EQ(points.count(), 9u);
  EXPECT_THAT(points.Flatten(core::RunContext()), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_TRUE(points.Flatten(core::RunContext()).empty());
  EXPECT_TRUE(receiver.TakePoints().Flatten(core::RunContext()).empty());
}

TEST(CloudReceiver, AcceptsAsManyPointsAsAllowedAndNotOneMore) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  ASSERT_TRUE(Accept(receiver, ParametersRequest()).ok());
  ASSERT_TRUE(Accept(receiver, PointsRequest(std::vector<double>(30))).ok());
  const grpc::Status status = Accept(receiver, PointsRequest({1, 2, 3}));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailsOf(status).reason, "TOO_MANY_POINTS");
  EXPECT_THAT(status.error_message(), HasSubstr("10"));
  EXPECT_EQ(receiver.point_count(), 10u);
}

TEST(CloudReceiver, RefusesPointsBeforeParameters) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  const grpc::Status status = Accept(receiver, PointsRequest({1, 2, 3}));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(DetailsOf(status).reason, "PARAMETERS_MISSING");
  EXPECT_EQ(DetailsOf(status).field, "parameters");
}

TEST(CloudReceiver, RefusesAnEndBeforeParameters) {
  const ServiceOptions options = SmallLimits();
  const grpc::Status status = ToGrpcStatus(CloudReceiver(options).AcceptEnd());
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(DetailsOf(status).reason, "PARAMETERS_MISSING");
}

TEST(CloudReceiver, RefusesParametersTwice) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  ASSERT_TRUE(Accept(receiver, ParametersRequest()).ok());
  const grpc::Status status = Accept(receiver, ParametersRequest());
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(DetailsOf(status).reason, "PARAMETERS_REPEATED");
  EXPECT_EQ(DetailsOf(status).field, "parameters");
}

TEST(CloudReceiver, RefusesAnEmptyRequest) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  const grpc::Status status = Accept(receiver, v1::MeshPointsRequest());
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(DetailsOf(status).reason, "EMPTY_REQUEST");
}

TEST(CloudReceiver, RefusesAPartOfAPoint) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  ASSERT_TRUE(Accept(receiver, ParametersRequest()).ok());
  ASSERT_TRUE(Accept(receiver, PointsRequest({1, 2, 3})).ok());
  const grpc::Status status = Accept(receiver, PointsRequest({1, 2, 3, 4}));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(DetailsOf(status).reason, "INVALID_CHUNK_SHAPE");
  EXPECT_EQ(DetailsOf(status).field, "points.coordinates");
  EXPECT_THAT(status.error_message(), HasSubstr("4 coordinates"));
}

TEST(CloudReceiver, KeepsRefusingAfterBadParameters) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  v1::MeshPointsRequest request;
  request.mutable_parameters()->set_dimension(0);
  EXPECT_EQ(DetailsOf(receiver.Accept(&request)).reason, "INVALID_PARAMETERS");
  EXPECT_EQ(DetailsOf(Accept(receiver, PointsRequest({1, 2, 3}))).reason, "PARAMETERS_MISSING");
}

v1::MeshPointsRequest InThePlane() {
  v1::MeshPointsRequest request;
  request.mutable_parameters()->set_dimension(2);
  return request;
}

v1::MeshPointsRequest SegmentsRequest(int count) {
  v1::MeshPointsRequest request;
  request.mutable_segments()->mutable_ends()->Resize(2 * count, 0);
  return request;
}

TEST(CloudReceiver, RefusesParametersThatADomainDoesNotHave) {
  const ServiceOptions options = SmallLimits();
  const auto refusal = [&](const v1::MeshPointsRequest& parameters, const v1::MeshPointsRequest& features) {
    CloudReceiver receiver(options);
    EXPECT_TRUE(Accept(receiver, parameters).ok());
    EXPECT_TRUE(receiver.AcceptEnd().ok()) << "a cloud has them all";
    EXPECT_TRUE(Accept(receiver, features).ok());
    return receiver.AcceptEnd();
  };
  v1::MeshPointsRequest parameters = InThePlane();
  EXPECT_TRUE(refusal(parameters, SegmentsRequest(2)).ok());
  parameters.mutable_parameters()->set_criterion(v1::CRITERION_WELL_SPACED);
  EXPECT_EQ(DetailsOf(refusal(parameters, SegmentsRequest(2))).reason, "INVALID_PARAMETERS");
  EXPECT_EQ(DetailsOf(refusal(parameters, SegmentsRequest(2))).field, "parameters.criterion");
  parameters = InThePlane();
  parameters.mutable_parameters()->mutable_domain()->mutable_low()->Resize(2, 0);
  parameters.mutable_parameters()->mutable_domain()->mutable_high()->Resize(2, 1);
  EXPECT_TRUE(refusal(parameters, SegmentsRequest(2)).ok());
  v1::MeshPointsRequest holes;
  holes.mutable_faces()->set_faces(v1::FACE_RULE_HOLES);
  EXPECT_EQ(DetailsOf(refusal(parameters, holes)).field, "parameters.domain");
}

TEST(CloudReceiver, AcceptsAsManySegmentsAndSeedsAsPoints) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  ASSERT_TRUE(Accept(receiver, InThePlane()).ok());
  ASSERT_TRUE(Accept(receiver, SegmentsRequest(10)).ok());
  EXPECT_EQ(DetailsOf(Accept(receiver, SegmentsRequest(1))).reason, "TOO_MANY_POINTS");
  v1::MeshPointsRequest seeds;
  for (int i = 0; i < 11; ++i) {
    seeds.mutable_faces()->add_seeds();
  }
  EXPECT_EQ(DetailsOf(Accept(receiver, seeds)).reason, "TOO_MANY_POINTS");
  EXPECT_EQ(receiver.features().counts().segments, 10u);
  EXPECT_EQ(receiver.features().counts().seeds, 0u);
}

// A record of a later version may ask for more than this one knows: it is not meshed without that.
TEST(ParametersFromRecord, RefusesFieldsOfALaterVersion) {
  v1::MeshParameters parameters;
  parameters.set_dimension(3);
  AddSizeBox(parameters, 0, 1, 0.5);
  EXPECT_TRUE(ParametersFromRecord(parameters).ok());
  constexpr int kLater = 12345;
  v1::MeshParameters whole = parameters;
  whole.GetReflection()->MutableUnknownFields(&whole)->AddVarint(kLater, 1);
  EXPECT_THAT(std::string(ParametersFromRecord(whole).status().message()), HasSubstr("a later version of Wellspace"));
  v1::SizeBox& box = *parameters.mutable_size_boxes(0);
  box.GetReflection()->MutableUnknownFields(&box)->AddVarint(kLater, 1);
  EXPECT_FALSE(ParametersFromRecord(parameters).ok()) << "a part of it has such a field";
  EXPECT_TRUE(ParametersFromProto(parameters, SmallLimits()).ok()) << "a request may";
}

TEST(CloudReceiver, TakesSegmentsIn2DAlone) {
  const ServiceOptions options = SmallLimits();
  CloudReceiver receiver(options);
  EXPECT_EQ(DetailsOf(Accept(receiver, SegmentsRequest(1))).reason, "PARAMETERS_MISSING");
  ASSERT_TRUE(Accept(receiver, ParametersRequest()).ok());
  const grpc::Status status = Accept(receiver, SegmentsRequest(1));
  EXPECT_EQ(DetailsOf(status).reason, "INVALID_SEGMENTS");
  EXPECT_EQ(DetailsOf(status).field, "segments");
}

TEST(MetadataToProto, CountsAndStatistics) {
  core::MeshParameters parameters;
  const core::Mesh mesh = MakeFakeMesh(parameters, std::vector<double>{0.25, 0.5, 0.75});
  const v1::MeshMetadata metadata = MetadataToProto(mesh, 5);
  EXPECT_EQ(metadata.dimension(), 3);
  EXPECT_THAT(metadata.domain().low(), ElementsAre(0, 0, 0));
  EXPECT_THAT(metadata.domain().high(), ElementsAre(1, 1, 1));
  EXPECT_EQ(metadata.vertex_count(), 9u);
  EXPECT_EQ(metadata.simplex_count(), 9u);
  EXPECT_EQ(metadata.input_point_count(), 1u);
  EXPECT_EQ(metadata.chunk_count(), 5u);
  EXPECT_EQ(metadata.statistics().counters().cuts(), 42u);
  EXPECT_EQ(metadata.statistics().seconds().total(), 0.5);
  EXPECT_FALSE(metadata.has_weights());
  EXPECT_EQ(metadata.statistics().triangulation(), v1::TRIANGULATION_DELAUNAY);
  EXPECT_FALSE(metadata.statistics().has_slivers());
}

TEST(MetadataToProto, SaysHowManyVerticesHaveMoved) {
  core::Mesh mesh = MakeFakeMesh(core::MeshParameters(), std::vector<double>{0.25, 0.5, 0.75});
  EXPECT_EQ(MetadataToProto(mesh, 1).moved_vertex_count(), 0u);
  mesh.moved_vertices = {7, 8};
  EXPECT_EQ(MetadataToProto(mesh, 1).moved_vertex_count(), 2u);
}

TEST(MetadataToProto, SaysWhatWasDoneAgainstSlivers) {
  core::Mesh mesh = MakeFakeMesh(core::MeshParameters(), std::vector<double>{0.25, 0.5, 0.75});
  // An angle of 0 before is no reason to say nothing.
  mesh.statistics.slivers_wanted = true;
  EXPECT_TRUE(MetadataToProto(mesh, 1).statistics().has_slivers());
  mesh.statistics.slivers = 7;
  mesh.statistics.slivers_left = 1;
  mesh.statistics.sliver_moves = 5;
  mesh.statistics.sliver_vertices = 2;
  mesh.statistics.min_angle_before_deg = 0.25;
  mesh.statistics.sliver_seconds = 0.125;
  mesh.statistics.sliver_operations = 12'345;
  mesh.statistics.slivers_left_by = {1, 2, 3};
  mesh.statistics.flattest_left = {{{4, 5, 6, 7}, 0.5, core::SliverReason::kWork}};
  v1::MeshStatistics statistics = MetadataToProto(mesh, 1).statistics();
  EXPECT_EQ(statistics.triangulation(), v1::TRIANGULATION_DELAUNAY);
  EXPECT_EQ(statistics.slivers().found(), 7u);
  EXPECT_EQ(statistics.slivers().left(), 1u);
  EXPECT_EQ(statistics.slivers().moves(), 5u);
  EXPECT_EQ(statistics.slivers().added_vertices(), 2u);
  EXPECT_EQ(statistics.slivers().min_angle_before_deg(), 0.25);
  EXPECT_EQ(statistics.seconds().slivers(), 0.125);
  EXPECT_EQ(statistics.slivers().operations(), 12'345u);
  EXPECT_EQ(statistics.slivers().left_by_demands(), 1u);
  EXPECT_EQ(statistics.slivers().left_by_angle(), 2u);
  EXPECT_EQ(statistics.slivers().left_by_work(), 3u);
  ASSERT_EQ(statistics.slivers().flattest_left_size(), 1);
  EXPECT_THAT(statistics.slivers().flattest_left(0).vertices(), ElementsAre(4, 5, 6, 7));
  EXPECT_EQ(statistics.slivers().flattest_left(0).min_dihedral_deg(), 0.5);
  EXPECT_EQ(statistics.slivers().flattest_left(0).reason(), v1::SLIVER_REASON_WORK);

  mesh.weights.assign(mesh.vertex_count(), 0.5);
  mesh.statistics.weighted_vertices = mesh.vertex_count();
  const v1::MeshMetadata metadata = MetadataToProto(mesh, 1);
  EXPECT_TRUE(metadata.has_weights());
  EXPECT_EQ(metadata.statistics().triangulation(), v1::TRIANGULATION_REGULAR);
  EXPECT_EQ(metadata.statistics().slivers().weighted_vertices(), mesh.vertex_count());
}

TEST(EstimateToProto, TakesEveryField) {
  const v1::EstimateMeshResponse message =
      EstimateToProto({.vertices = 1, .simplices = 2, .memory_bytes = 3, .tree_leaves = 4});
  EXPECT_EQ(message.vertices(), 1u);
  EXPECT_EQ(message.simplices(), 2u);
  EXPECT_EQ(message.memory_bytes(), 3u);
  EXPECT_EQ(message.tree_leaves(), 4u);
}

}  // namespace
}  // namespace wellspace::server
