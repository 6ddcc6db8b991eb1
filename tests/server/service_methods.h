// All methods that there are, found by reflection, so that a new one is tested without being named.
#ifndef WELLSPACE_TESTS_SERVER_SERVICE_METHODS_H_
#define WELLSPACE_TESTS_SERVER_SERVICE_METHODS_H_

#include <memory>
#include <string>
#include <vector>

#include "google/protobuf/descriptor.h"
#include "google/protobuf/message.h"

namespace wellspace::server {

// Every method of every service of wellspace.v1.
std::vector<const google::protobuf::MethodDescriptor*> ServiceMethods();

// "/package.Service/Method".
std::string PathOf(const google::protobuf::MethodDescriptor& method);

std::unique_ptr<google::protobuf::Message> MakeMessage(const google::protobuf::Descriptor& type);

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_SERVICE_METHODS_H_
