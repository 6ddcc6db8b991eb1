#include "server/store/postgres_options.h"

#include <libpq-fe.h>

#include <map>
#include <memory>

#include "absl/strings/str_cat.h"

namespace wellspace::server {

absl::StatusOr<std::string> ShownPostgresAddress(const std::string& address) {
  const bool is_uri = address.starts_with("postgresql://") || address.starts_with("postgres://");
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> options(
      is_uri ? PQconninfoParse(address.c_str(), nullptr) : nullptr, &PQconninfoFree);
  if (options == nullptr) {
    return absl::InvalidArgumentError(
        "expected postgresql://USER:PASSWORD@HOST:PORT/DATABASE, as libpq has it; other characters than letters and "
        "digits are %XX there");
  }
  std::map<std::string, std::string> values;
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    values[option->keyword] = option->val == nullptr ? "" : option->val;
  }
  const auto with = [&](const char* before, const char* key, const char* after) {
    return values[key].empty() ? std::string() : absl::StrCat(before, values[key], after);
  };
  return absl::StrCat("postgresql://", with("", "user", "@"), with("", "host", ""), with(":", "port", ""), "/",
                      values["dbname"]);
}

}  // namespace wellspace::server
