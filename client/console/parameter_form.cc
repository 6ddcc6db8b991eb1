#include "client/console/parameter_form.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/util/json_util.h>

#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/grpc/convert.h"
#include "wellspace/v1/mesh.pb.h"

// mesh.proto with its comments, which generated code has none of: wellspace_embed.
extern "C" const char wellspace_console_proto_begin[];
extern "C" const char wellspace_console_proto_end[];

namespace wellspace::console {
namespace {

using google::protobuf::FieldDescriptor;

// The proto as its descriptors with comments. Lives as long as the program.
const google::protobuf::Descriptor& Parameters() {
  static const google::protobuf::Descriptor* const parameters = [] {
    google::protobuf::FileDescriptorSet files;
    files.ParseFromArray(wellspace_console_proto_begin,
                         static_cast<int>(wellspace_console_proto_end - wellspace_console_proto_begin));
    auto* const pool = new google::protobuf::DescriptorPool();
    for (const google::protobuf::FileDescriptorProto& file : files.file()) {
      pool->BuildFile(file);
    }
    return pool->FindMessageTypeByName(std::string(v1::MeshParameters::descriptor()->full_name()));
  }();
  return *parameters;
}

std::string HelpOf(const FieldDescriptor& field) {
  google::protobuf::SourceLocation location;
  if (!field.GetSourceLocation(&location)) {
    return "";
  }
  std::string help = location.leading_comments;
  absl::StripAsciiWhitespace(&help);
  return absl::StrReplaceAll(help, {{"\n ", " "}, {"\n", " "}});
}

const char* KindOf(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return "number";
    case FieldDescriptor::CPPTYPE_BOOL:
      return "boolean";
    case FieldDescriptor::CPPTYPE_ENUM:
      return "choice";
    default:
      return "integer";
  }
}

bool IsOfForm(const FieldDescriptor& field) {
  return !field.is_repeated() &&
         !(field.containing_type() == &Parameters() && field.number() == v1::MeshParameters::kDimensionFieldNumber);
}

// Adds the fields of `message`, whose own name comes before theirs, with a dot.
void AddFields(const google::protobuf::Descriptor& message, const std::string& prefix, client::Json& form) {
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    if (!IsOfForm(field)) {
      continue;
    }
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      AddFields(*field.message_type(), absl::StrCat(prefix, field.name(), "."), form);
      continue;
    }
    client::Json& one = form.emplace_back();
    one["name"] = absl::StrCat(prefix, field.name());
    one["kind"] = KindOf(field);
    one["help"] = HelpOf(field);
    if (field.enum_type() != nullptr) {
      for (int k = 0; k < field.enum_type()->value_count(); ++k) {
        if (field.enum_type()->value(k)->number() != 0) {  // that is none
          one["choices"].push_back(field.enum_type()->value(k)->name());
        }
      }
    }
  }
}

// Clears the fields of `message` that `named` names, also those of messages in it.
void ClearNamed(const nlohmann::json& named, google::protobuf::Message& message) {
  for (const auto& [name, value] : named.items()) {
    const FieldDescriptor* const field = message.GetDescriptor()->FindFieldByName(name);
    if (field == nullptr) {
      continue;
    }
    if (value.is_object() && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && !field->is_repeated()) {
      ClearNamed(value, *message.GetReflection()->MutableMessage(&message, field));
    } else {
      message.GetReflection()->ClearField(&message, field);
    }
  }
}

}  // namespace

client::Json ParameterForm() {
  client::Json form = client::Json::array();
  AddFields(Parameters(), "", form);
  return form;
}

absl::StatusOr<client::MeshOptions> ParametersOf(const std::string& json, const client::MeshOptions& before) {
  v1::MeshParameters parameters;
  client::SetParameters(before, &parameters);
  if (!json.empty()) {
    v1::MeshParameters changes;
    if (const auto status = google::protobuf::util::JsonStringToMessage(json, &changes); !status.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat("parameters: ", std::string(status.message()), "; expected an object of MeshParameters"));
    }
    // Its fields take the place of those before, and null that of a default.
    // protobuf takes texts that are not quite JSON.
    const nlohmann::json named = nlohmann::json::parse(json, nullptr, /*allow_exceptions=*/false);
    if (!named.is_object()) {
      return absl::InvalidArgumentError("parameters: no JSON; expected an object of MeshParameters");
    }
    ClearNamed(named, parameters);
    parameters.MergeFrom(changes);
  }
  return client::OptionsFromProto(parameters);
}

}  // namespace wellspace::console
