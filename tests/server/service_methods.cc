#include "tests/server/service_methods.h"

#include "absl/strings/str_cat.h"
#include "wellspace/v1/admin.pb.h"
#include "wellspace/v1/meshing.pb.h"
#include "wellspace/v1/operations.pb.h"
#include "wellspace/v1/queries.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

std::vector<const google::protobuf::MethodDescriptor*> ServiceMethods() {
  std::vector<const google::protobuf::MethodDescriptor*> methods;
  for (const google::protobuf::FileDescriptor* file :
       {v1::MeshPointsRequest::descriptor()->file(), v1::Session::descriptor()->file(),
        v1::Operation::descriptor()->file(), v1::VoronoiCellsRequest::descriptor()->file(),
        v1::GetUsageRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service_count(); ++i) {
      for (int j = 0; j < file->service(i)->method_count(); ++j) {
        methods.push_back(file->service(i)->method(j));
      }
    }
  }
  return methods;
}

std::string PathOf(const google::protobuf::MethodDescriptor& method) {
  return absl::StrCat("/", method.service()->full_name(), "/", method.name());
}

std::unique_ptr<google::protobuf::Message> MakeMessage(const google::protobuf::Descriptor& type) {
  return std::unique_ptr<google::protobuf::Message>(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
}

}  // namespace wellspace::server
