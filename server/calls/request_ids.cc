#include "server/calls/request_ids.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include "absl/strings/str_cat.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// What an entry takes besides its id and its answer, generously.
constexpr size_t kEntryBytes = 256;

// Of the type and the content; equal messages have equal ones, whatever the order of their map fields.
size_t HashOf(const google::protobuf::Message& message) {
  std::string bytes = message.GetTypeName();
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream out(&stream);
    out.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&out);
  }
  return std::hash<std::string>()(bytes);
}

}  // namespace

void RequestIds::Once(const std::string& tenant_name, const std::string& request_id,
                      const google::protobuf::Message& request, const std::function<void(Done)>& work, Done done) {
  if (request_id.empty()) {
    work(std::move(done));
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
  const size_t content = HashOf(request);
  Answer known;
  {
    std::unique_lock lock(mutex_);
    Tenant& tenant = tenants_[tenant_name];
    Trim(tenant);
    const auto found = tenant.by_id.find(request_id);
    if (found == tenant.by_id.end()) {
      tenant.entries.push_back(
          Entry{.request_id = request_id, .content = content, .time = since_boot_(), .answer = {}, .waiting = {}});
      tenant.entries.back().waiting.push_back(std::move(done));
      tenant.by_id.emplace(request_id, std::prev(tenant.entries.end()));
      tenant.bytes += kEntryBytes + request_id.size();
      lock.unlock();
      work([this, tenant_name, request_id](const Answer& answer) { Finish(tenant_name, request_id, answer); });
      return;
    }
    Entry& entry = *found->second;
    if (entry.content != content) {
      known.status = MakeError(v1::ERROR_REASON_REQUEST_ID_REUSED,
                               absl::StrCat("request_id \"", request_id, "\" was used for another request in the last ",
                                            absl::FormatDuration(kKeptFor), "; give every request an id of its own"),
                               "request_id");
    } else if (entry.is_answered) {
      known = entry.answer;
    } else {
      entry.waiting.push_back(std::move(done));
      return;
    }
  }
  done(known);
}

void RequestIds::Finish(const std::string& tenant_name, const std::string& request_id, const Answer& answer) {
  std::vector<Done> waiting;
  {
    std::lock_guard lock(mutex_);
    Tenant& tenant = tenants_[tenant_name];
    const auto entry = tenant.by_id.at(request_id);
    waiting.swap(entry->waiting);
    entry->is_answered = true;
    if (answer.status.ok()) {
      entry->answer = answer;
      tenant.bytes += answer.response.size();
      Trim(tenant);
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

void RequestIds::Trim(Tenant& tenant) {
  const absl::Duration oldest = since_boot_() - kKeptFor;
  for (auto entry = tenant.entries.begin(); entry != tenant.entries.end();) {
    const bool is_too_much = tenant.entries.size() > kMaxPerTenant || tenant.bytes > kMaxBytesPerTenant;
    if (entry->time >= oldest && !is_too_much) {
      return;
    }
    const auto next = std::next(entry);
    if (entry->is_answered) {
      Erase(tenant, entry);
    }
    entry = next;
  }
}

}  // namespace wellspace::server
