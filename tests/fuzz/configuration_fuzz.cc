// Configuration that an operator writes: every reader of it, on any text.
//
// Input: a digit from 0 to 3, then
//   0  a file of tokens;
//   1  a certificate, '|', its key, '|', the authorities of clients;
//   2  a file of options, in TOML;
//   3  an address to listen on.
#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_split.h"
#include "absl/time/time.h"
#include "server/limit_flags.h"
#include "server/network/listen_address.h"
#include "server/security/tls.h"
#include "server/security/tokens.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"

namespace wellspace::fuzz {
namespace {

std::string MessageOf(const absl::Status& status) {
  Require(status.code() == absl::StatusCode::kInvalidArgument, "bad input is an INVALID_ARGUMENT:", status.ToString());
  return std::string(status.message());
}

void ReadTokens(std::string_view text) {
  const std::vector<std::string> words =
      absl::StrSplit(absl::string_view(text.data(), text.size()), absl::ByAnyChar(" \t\r\n#"));
  const absl::StatusOr<server::TokenTable> tokens = server::TokenTable::Parse(text);
  if (!tokens.ok()) {
    const std::string message = MessageOf(tokens.status());
    for (const std::string& word : words) {
      // It may be a token that was not hashed.
      Require(word.size() < server::TokenTable::kMinTokenLength || message.find(word) == std::string::npos,
              "an error repeats no token:", message);
    }
    return;
  }
  for (const std::string& word : words) {
    Require(!tokens->CallerOf(word).has_value(), "a hash is no token:", word);
  }
}

void ReadCertificates(std::string_view text) {
  std::vector<std::string> parts = absl::StrSplit(absl::string_view(text.data(), text.size()), absl::MaxSplits('|', 2));
  parts.resize(3);
  const ScratchFolder& folder = ScratchFolder::Get();
  const server::TlsOptions options = {.certificate = folder.Write("certificate", parts[0]),
                                      .key = folder.Write("key", parts[1]),
                                      .client_ca = parts[2].empty() ? "" : folder.Write("ca", parts[2])};
  if (const absl::Status status = server::ReadTlsFiles(options).status(); !status.ok()) {
    MessageOf(status);
    RequireClearMessage({status.message().data(), status.message().size()});
  }
}

void ReadOptions(std::string_view text) {
  server::ServiceOptions options;
  CLI::App app("fuzz", "wellspaced");
  server::DeclareLimits(app, options);
  server::DeclareConfigFile(app);
  std::vector<std::string> arguments = {ScratchFolder::Get().Write("wellspaced.toml", text),
                                        "--config"};  // the last comes first
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    Require(error.what()[0] != '\0', "an error says what is wrong");
    return;
  }
  Require(options.workers >= 1 && options.max_threads >= 1 && options.max_queued_jobs >= 0 &&
              options.max_jobs_per_tenant >= 1 && options.keep_queued >= 0 && options.max_points >= 1 &&
              options.max_vertices >= 1 && options.max_vertices <= core::kMaxVertices && options.max_sessions >= 1,
          "counts are in their ranges");
  Require(options.max_memory_bytes == 0 || options.max_memory_bytes >= server::kMinMemoryBytes, "memory suffices");
  Require(options.default_ttl >= absl::Seconds(1) && options.default_ttl <= options.max_ttl &&
              options.stall_limit > absl::ZeroDuration() && options.max_ttl < absl::InfiniteDuration(),
          "durations are in their ranges");
}

void ReadAddress(const std::string& text) {
  const absl::StatusOr<server::ListenAddress> address = server::ParseListenAddress(text);
  if (!address.ok()) {
    MessageOf(address.status());
    return;
  }
  const absl::StatusOr<server::ListenAddress> again = server::ParseListenAddress(address->ToString());
  Require(again.ok() && again->host == address->host && again->port == address->port, "an address reads back:", text);
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  wellspace::fuzz::ByteReader bytes(data, size);
  switch (static_cast<uint8_t>(bytes.Next() - '0') % 4) {
    case 0:
      wellspace::fuzz::ReadTokens(bytes.TakeText());
      break;
    case 1:
      wellspace::fuzz::ReadCertificates(bytes.TakeText());
      break;
    case 2:
      wellspace::fuzz::ReadOptions(bytes.TakeText());
      break;
    default:
      wellspace::fuzz::ReadAddress(std::string(bytes.TakeText()));
  }
  return 0;
}
