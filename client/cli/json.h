// The output of the tool with --output json: the names of client/json in the tool.
#ifndef WELLSPACE_CLIENT_CLI_JSON_H_
#define WELLSPACE_CLIENT_CLI_JSON_H_

#include "client/json/json.h"
#include "client/rule_names.h"

namespace wellspace::cli {

using client::CriterionName;
using client::CrossingRuleName;
using client::ErrorJson;
using client::FaceRuleName;
using client::HealthName;
using client::Json;
using client::JsonText;
using client::OperationJson;
using client::ParametersJson;
using client::ProgressJson;
using client::ServerInfoJson;
using client::SessionJson;
using client::SolidRuleName;
using client::StateName;
using client::TimeText;

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_JSON_H_
