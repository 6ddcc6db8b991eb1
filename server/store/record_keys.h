// The checksums beside records: of the record, and of the row that it belongs to. For the stores of records alone.
#ifndef WELLSPACE_SERVER_STORE_RECORD_KEYS_H_
#define WELLSPACE_SERVER_STORE_RECORD_KEYS_H_

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "proto/checksum.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// The checksum of a record that belongs to `key`.
inline uint64_t ChecksumOf(const std::string& key, std::string_view record) {
  return ExtendCrc32c(Crc32c(key.data(), key.size()), record.data(), record.size());
}

// `epoch`: that of its row; 0: it was written before there were epochs.
inline std::string KeyOfSession(std::string_view name, int64_t epoch) {
  return epoch == 0 ? absl::StrCat("session ", std::string(name))
                    : absl::StrCat("session ", std::string(name), " at ", epoch);
}
inline std::string KeyOfEpochs(int64_t last, int64_t everything) {
  return absl::StrCat("epochs ", last, " ", everything);
}
inline std::string KeyOfStep(int64_t session, int64_t number, int64_t kind) {
  return absl::StrCat("step ", session, " ", number, " ", kind);
}
inline std::string KeyOfOperation(int64_t session, int64_t number) {
  return absl::StrCat("operation ", session, " ", number);
}
inline std::string KeyOfSizes(int64_t session, int64_t number, int64_t part) {
  return absl::StrCat("sizes ", session, " ", number, " ", part);
}
inline std::string KeyOfAnswer(std::string_view tenant, std::string_view request_id) {
  return absl::StrCat("answer ", tenant.size(), " ", std::string(tenant), " ", std::string(request_id));
}

// `owner`: of the row, where several have rows of one tenant and day; else 0.
inline std::string KeyOfUsage(std::string_view tenant, int64_t day, int64_t owner) {
  return absl::StrCat("usage ", std::string(tenant), " ", day, " ", owner);
}

// Whether `record` is that of `key`, undamaged.
template <typename Record>
bool ParseRecord(const std::string& key, std::string_view bytes, int64_t checksum, Record& record) {
  return ChecksumOf(key, bytes) == static_cast<uint64_t>(checksum) &&
         record.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

inline constexpr int kFeaturesStep = store::v1::StepRecord::kFeatures;

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_RECORD_KEYS_H_
