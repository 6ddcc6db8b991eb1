#include "server/sessions/idle_sessions.h"

#include <malloc.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

namespace wellspace::server {

std::vector<size_t> ChooseIdle(std::span<const Session::Spare> sessions, uint64_t missing, MemoryBudget::Want want) {
  std::vector<size_t> chosen(sessions.size());
  std::iota(chosen.begin(), chosen.end(), size_t{0});
  std::ranges::stable_sort(chosen, {}, [&](size_t i) { return sessions[i].last_use; });
  uint64_t freed = 0;
  size_t count = 0;
  while (count < chosen.size() && freed < missing) {
    freed += sessions[chosen[count++]].bytes;
  }
  chosen.resize(count);
  if (freed < missing && want == MemoryBudget::Want::kAllOrNothing) {
    return {};
  }
  // The sessions chosen last may free enough without some chosen before. Those used last are spared first.
  std::ranges::reverse(chosen);
  std::erase_if(chosen, [&](size_t i) {
    const bool is_needless = freed >= missing + sessions[i].bytes;
    freed -= is_needless ? sessions[i].bytes : 0;
    return is_needless;
  });
  std::ranges::sort(chosen);
  return chosen;
}

IdleSessions::IdleSessions(const SessionRegistry& sessions, MemoryBudget& memory, WorkObserver& observer, Clock clock)
    : sessions_(sessions), memory_(memory), observer_(observer), clock_(std::move(clock)) {
  memory_.SetGiveUp([this](uint64_t missing, MemoryBudget::Want want) { return GiveUp(missing, want); });
}

IdleSessions::~IdleSessions() { memory_.SetGiveUp(nullptr); }

bool IdleSessions::GiveUp(uint64_t missing, MemoryBudget::Want want) const {
  const std::vector<std::shared_ptr<Session>> all = sessions_.All();
  uint64_t freed = 0;
  uint64_t freed_before = 0;
  do {  // once more where a session that was chosen is not idle any more
    freed_before = freed;
    freed += GiveUpOnce(all, missing - freed, want);
  } while (freed < missing && freed > freed_before);
  if (freed > 0) {
    malloc_trim(0);  // others may have the memory once the system has it
  }
  const bool may_have_more = freed >= missing || want == MemoryBudget::Want::kAllOrNothing;
  return may_have_more && std::ranges::any_of(all, [](const auto& session) { return session->GetSpare().has_value(); });
}

uint64_t IdleSessions::GiveUpOnce(std::span<const std::shared_ptr<Session>> all, uint64_t missing,
                                  MemoryBudget::Want want) const {
  std::vector<std::shared_ptr<Session>> idle;
  std::vector<Session::Spare> spares;
  for (const std::shared_ptr<Session>& session : all) {
    if (const std::optional<Session::Spare> spare = session->GetSpare()) {
      idle.push_back(session);
      spares.push_back(*spare);
    }
  }
  uint64_t freed = 0;
  for (const size_t i : ChooseIdle(spares, missing, want)) {
    const uint64_t bytes = idle[i]->GiveUpMemory();
    if (bytes > 0) {
      freed += bytes;
      observer_.OnStructureGivenUp({.session = idle[i]->name(),
                                    .tenant = idle[i]->tenant(),
                                    .bytes = bytes,
                                    .idle = clock_.since_boot() - spares[i].last_use});
    }
  }
  return freed;
}

}  // namespace wellspace::server
