#include "server/calls/request_ids.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <openssl/sha.h>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// The memory of an entry besides its id and its answer, generously.
constexpr size_t kEntryBytes = 256;

// Of the type and the content; equal messages have equal ones, whatever the order of their map fields, and in every
// build.
std::string DigestOf(const google::protobuf::Message& message) {
  std::string bytes = message.GetTypeName();
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream out(&stream);
    out.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&out);
  }
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

absl::Status Reused(const std::string& request_id) {
  return MakeError(v1::ERROR_REASON_REQUEST_ID_REUSED,
                   absl::StrCat("request_id \"", request_id, "\" was used for another request in the last ",
                                absl::FormatDuration(RequestIds::kKeptFor), "; give every request an id of its own"),
                   "request_id");
}

}  // namespace

std::optional<store::v1::AnswerRecord> IdentifiedRequest::Answer(const google::protobuf::Message& response) const {
  if (request_id.empty()) {
    return std::nullopt;
  }
  store::v1::AnswerRecord record;
  record.set_tenant(tenant);
  record.set_request_id(request_id);
  record.set_content(content);
  record.set_response(response.SerializeAsString());
  record.set_time_ns(absl::GetCurrentTimeNanos());
  return record;
}

void RequestIds::Restore(std::vector<store::v1::AnswerRecord> answers) {
  std::lock_guard lock(mutex_);
  for (store::v1::AnswerRecord& record : answers) {
    Tenant& tenant = tenants_[record.tenant()];
    Entry& entry = Add(tenant, std::move(*record.mutable_request_id()), std::move(*record.mutable_content()));
    entry.is_answered = true;
    entry.answer.response = std::move(*record.mutable_response());
    tenant.bytes += entry.answer.response.size();
  }
}

RequestIds::Entry& RequestIds::Add(Tenant& tenant, std::string request_id, std::string content) {
  tenant.bytes += kEntryBytes + request_id.size();
  tenant.entries.push_back(Entry{.request_id = std::move(request_id),
                                 .content = std::move(content),
                                 .time = since_boot_(),
                                 .answer = {},
                                 .waiting = {}});
  Entry& entry = tenant.entries.back();
  tenant.by_id.emplace(entry.request_id, std::prev(tenant.entries.end()));
  return entry;
}

void RequestIds::Once(const std::string& tenant_name, const std::string& request_id,
                      const google::protobuf::Message& request,
                      const std::function<void(const IdentifiedRequest&, Done)>& work, Done done) {
  IdentifiedRequest identified{.tenant = tenant_name, .request_id = request_id, .content = {}};
  if (request_id.empty()) {
    work(identified, std::move(done));
    return;
  }
  if (request_id.size() > kMaxLength) {
    done({MakeError(
              v1::ERROR_REASON_INVALID_REQUEST,
              absl::StrCat("request_id has ", request_id.size(), " characters; at most ", kMaxLength, " are accepted"),
              "request_id"),
          ""});
    return;
  }
  identified.content = DigestOf(request);
  Answer known;
  {
    std::unique_lock lock(mutex_);
    Tenant& tenant = tenants_[tenant_name];
    Trim(tenant_name, tenant);
    const auto found = tenant.by_id.find(request_id);
    if (found == tenant.by_id.end()) {
      Add(tenant, request_id, identified.content).waiting.push_back(std::move(done));
      lock.unlock();
      work(identified, [this, identified](const Answer& answer) { Finish(identified, answer); });
      return;
    }
    Entry& entry = *found->second;
    if (entry.content != identified.content) {
      known.status = Reused(request_id);
    } else if (entry.is_answered) {
      known = entry.answer;
    } else {
      entry.waiting.push_back(std::move(done));
      return;
    }
  }
  done(known);
}

std::optional<RequestIds::Answer> RequestIds::AnswerOfAnother(const IdentifiedRequest& request) {
  auto found = records_.FindAnswer({.tenant = request.tenant, .request_id = request.request_id});
  if (!found.ok() || !found->has_value()) {
    return std::nullopt;
  }
  return (*found)->content() == request.content ? Answer{absl::OkStatus(), std::move(*(*found)->mutable_response())}
                                                : Answer{Reused(request.request_id), ""};
}

void RequestIds::Finish(const IdentifiedRequest& request, const Answer& own_answer) {
  Answer answer = own_answer.status.ok() ? own_answer : AnswerOfAnother(request).value_or(own_answer);
  if (IsAnsweredBefore(answer.status)) {
    answer.status = MakeError(v1::ERROR_REASON_STORE_FAILED,
                              absl::StrCat("request ", request.request_id,
                                           " was answered before, and the answer cannot be read now; try again"));
  }
  std::vector<Done> waiting;
  {
    std::lock_guard lock(mutex_);
    Tenant& tenant = tenants_[request.tenant];
    const auto entry = tenant.by_id.at(request.request_id);
    waiting.swap(entry->waiting);
    entry->is_answered = true;
    if (answer.status.ok()) {
      entry->answer = answer;
      tenant.bytes += answer.response.size();
      Trim(request.tenant, tenant);
    } else {
      Erase(tenant, entry);
    }
  }
  for (const Done& done : waiting) {
    done(answer);
  }
}

void RequestIds::Erase(Tenant& tenant, std::list<Entry>::iterator entry) {
  tenant.bytes -= kEntryBytes + entry->request_id.size() + entry->answer.response.size();
  tenant.by_id.erase(entry->request_id);
  tenant.entries.erase(entry);
}

void RequestIds::Trim(const std::string& tenant_name, Tenant& tenant) {
  const absl::Duration oldest = since_boot_() - kKeptFor;
  std::vector<AnswerKey> forgotten;
  for (auto entry = tenant.entries.begin(); entry != tenant.entries.end();) {
    const bool is_too_much = tenant.entries.size() > kMaxPerTenant || tenant.bytes > kMaxBytesPerTenant;
    if (entry->time >= oldest && !is_too_much) {
      break;
    }
    const auto next = std::next(entry);
    if (entry->is_answered) {
      forgotten.push_back({.tenant = tenant_name, .request_id = entry->request_id});
      Erase(tenant, entry);
    }
    entry = next;
  }
  if (!forgotten.empty()) {
    records_.Forget(forgotten);
  }
}

}  // namespace wellspace::server
