// The parameters of a mesh as a form, made of the descriptors of the API.
#ifndef WELLSPACE_CLIENT_CONSOLE_PARAMETER_FORM_H_
#define WELLSPACE_CLIENT_CONSOLE_PARAMETER_FORM_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/json/json.h"
#include "client/types.h"

namespace wellspace::console {

// A list of the fields of MeshParameters that have one value, but for the dimension: {name, kind: "number", "integer",
// "boolean" or "choice", choices, help: the comment of the proto}. Those of `surface` are among them, as
// "surface.tolerance".
client::Json ParameterForm();

// `before`, with the parameters that `json` names, an object as protobuf has it, with names as the proto writes them;
// null is the default. Empty: no object.
//
// Errors:     INVALID_ARGUMENT: it is no JSON, or names a field that the proto has not, or a value that a field cannot
//             have.
absl::StatusOr<client::MeshOptions> ParametersOf(const std::string& json, const client::MeshOptions& before);

}  // namespace wellspace::console

#endif  // WELLSPACE_CLIENT_CONSOLE_PARAMETER_FORM_H_
