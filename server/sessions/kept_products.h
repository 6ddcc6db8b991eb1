// Products of a session's mesh that are made when they are first asked for, and kept for those who ask next.
#ifndef WELLSPACE_SERVER_SESSIONS_KEPT_PRODUCTS_H_
#define WELLSPACE_SERVER_SESSIONS_KEPT_PRODUCTS_H_

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/base/status_macros.h"
#include "server/store/mesh_snapshot.h"

namespace wellspace::server {

// Makes products of one session's mesh, and keeps them until there is another mesh, other products want their place, or
// other work wants their memory. A `Product` has its `revision`, that of its mesh, and its `memory`, a
// MemoryReservation.
//
// Thread safety: thread-safe.
// Invariants: (1) at most `most` products are kept, all of one revision; (2) at most one is being made.
template <typename Product>
class KeptProducts {
 public:
  using Made = std::shared_ptr<const Product>;
  // The mesh that the product is wanted of, or why there is none.
  using FindMesh = absl::FunctionRef<absl::StatusOr<std::shared_ptr<const MeshSnapshot>>()>;
  // Whether a product, which is of the right mesh, is the one that is wanted.
  using Fits = absl::FunctionRef<bool(const Product&)>;
  using Make = absl::FunctionRef<absl::StatusOr<Made>(const MeshSnapshot&)>;

  static bool IsAny(const Product& /*product*/) { return true; }

  explicit KeptProducts(size_t most = 1) : most_(most) {}

  // The kept product that fits; else `make` makes it, on this thread, a worker's. While another one is being made,
  // callers wait on their threads; but if `is_at_work` is there, it becomes true, and null is returned at once: to be
  // tried again. Callers that wait need no second worker, if `make` does not wait for memory, and has it at once or is
  // refused. Their cancels are seen after that.
  //
  // Errors:     of `find_mesh`, which is called with no lock but that of the one who makes a product; of `make`.
  absl::StatusOr<Made> Prepare(FindMesh find_mesh, Make make, Fits fits = IsAny, bool* is_at_work = nullptr) {
    std::unique_lock making(making_mutex_, std::defer_lock);
    if (is_at_work == nullptr) {
      making.lock();
    } else if (!making.try_lock()) {
      WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const MeshSnapshot> wanted, find_mesh());
      Made found = Find(wanted->revision(), fits);
      *is_at_work = found == nullptr;
      return found;
    }
    // After the wait: there may be another mesh by now.
    WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const MeshSnapshot> mesh, find_mesh());
    NoteAskedFor(mesh->revision());
    if (Made found = Find(mesh->revision(), fits); found != nullptr) {
      return found;
    }
    {
      std::lock_guard lock(mutex_);
      is_replaced_ = false;
    }
    is_making_ = true;
    const absl::Cleanup end = [this] { is_making_ = false; };
    (void)MakePlaceFor(mesh->revision());  // freed without mutex_, and before another takes memory
    WELLSPACE_ASSIGN_OR_RETURN(Made made, make(*mesh));
    std::lock_guard lock(mutex_);
    // Not one of a mesh that was replaced meanwhile: no change would take it away.
    if (!is_replaced_ && (kept_.empty() || kept_.front()->revision == made->revision)) {
      kept_.push_back(made);
    }
    return made;
  }

  // The kept product of the mesh at `revision` that fits, or null.
  Made Find(uint64_t revision, Fits fits = IsAny) const {
    std::lock_guard lock(mutex_);
    const auto found =
        std::ranges::find_if(kept_, [&](const Made& one) { return one->revision == revision && fits(*one); });
    return found == kept_.end() ? nullptr : *found;
  }
  // Whether one is being made now.
  bool IsMaking() const { return is_making_; }

  // The bytes that GiveUp would free: those of products that no caller uses.
  uint64_t SpareBytes() const {
    std::lock_guard lock(mutex_);
    uint64_t bytes = 0;
    for (const Made& one : kept_) {
      bytes += IsSpare(one) ? one->memory.bytes() : 0;
    }
    return bytes;
  }
  // Hands over the products that no caller uses, for the caller to free them without a lock.
  [[nodiscard]] std::vector<Made> GiveUp() {
    std::lock_guard lock(mutex_);
    return TakeIf(IsSpare);
  }
  // There is another mesh: hands over all of them; those in use live on with their users.
  [[nodiscard]] std::vector<Made> Drop() { return Replace({}); }
  // Keeps `products` from now on, all of one revision, and hands over those before.
  [[nodiscard]] std::vector<Made> Replace(std::vector<Made> products) {
    std::lock_guard lock(mutex_);
    std::vector<Made> before = TakeIf([](const Made&) { return true; });
    is_replaced_ = true;
    kept_.assign(std::make_move_iterator(products.begin()), std::make_move_iterator(products.end()));
    return before;
  }

  // Whether a product of the mesh at `revision` was asked for, and of no later one since.
  bool WasAskedFor(uint64_t revision) const {
    std::lock_guard lock(mutex_);
    return asked_for_ == revision;
  }

 private:
  void NoteAskedFor(uint64_t revision) {
    std::lock_guard lock(mutex_);
    asked_for_ = std::max(asked_for_, revision);
  }

  // Wants mutex_ to be held, under which alone others get one.
  static bool IsSpare(const Made& one) { return one.use_count() == 1; }

  // Wants mutex_ to be held.
  template <typename Predicate>
  std::vector<Made> TakeIf(Predicate predicate) {
    std::vector<Made> taken;
    std::deque<Made> left;
    for (Made& one : kept_) {
      if (predicate(one)) {
        taken.push_back(std::move(one));
      } else {
        left.push_back(std::move(one));
      }
    }
    kept_ = std::move(left);
    return taken;
  }

  // Products of meshes before that at `revision` go, and the oldest where there are as many as may be. Those of a later
  // mesh stay.
  std::vector<Made> MakePlaceFor(uint64_t revision) {
    std::lock_guard lock(mutex_);
    std::vector<Made> dropped = TakeIf([&](const Made& one) { return one->revision < revision; });
    if (kept_.size() >= most_ && kept_.front()->revision == revision) {
      dropped.push_back(std::move(kept_.front()));
      kept_.pop_front();
    }
    return dropped;
  }

  const size_t most_;
  std::atomic<bool> is_making_ = false;
  std::mutex making_mutex_;   // before that of the session, and mutex_; held while one is made
  mutable std::mutex mutex_;  // after that of the session
  std::deque<Made> kept_;     // guarded by mutex_; the oldest first
  uint64_t asked_for_ = 0;    // guarded by mutex_; the last revision; 0: none
  bool is_replaced_ = false;  // guarded by mutex_; since the last product was begun
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_KEPT_PRODUCTS_H_
