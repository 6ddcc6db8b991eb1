#include "server/store/durable_log.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "core/base/status_macros.h"
#include "server/store/mesh_file.h"
#include "server/store/point_file.h"
#include "server/wire/errors.h"
#include "server/wire/hidden_folders.h"

namespace wellspace::server {
namespace {

// Of one transaction: enough that a synchronisation costs each little, and few enough that none waits for long.
constexpr size_t kMaxBatch = 256;
constexpr uint64_t kMaxBatchBytes = uint64_t{8} << 20;

// Of the ballast the write-ahead log takes so much, before it is taken over; a batch, and deletions, have the rest.
constexpr uint64_t kBallastPerLog = 4;
constexpr uint64_t kPageBytes = 4096;
constexpr uint64_t kMostBallast = uint64_t{16} << 20;
constexpr uint64_t kDiskPerBallast = 16;
constexpr int kLeastLogPages = 8;

uint64_t BytesOf(const SessionChange& change) {
  uint64_t bytes = change.answer.has_value() ? change.answer->ByteSizeLong() : 0;
  for (const store::v1::StepRecord& step : change.steps) {
    bytes += step.ByteSizeLong();
  }
  if (change.sizes.has_value()) {
    bytes += change.sizes->in_turn.bytes;
    for (const store::v1::SizesRecord& part : change.sizes->parts) {
      bytes += part.ByteSizeLong();
    }
  }
  return bytes;
}

// Whether files may be removed. Not after a failure: the change that was under way may have been written down, and name
// what its owner believes to be obsolete. Not during a back-up: its copy of the rows names what is obsolete by now. Nor
// when it is not known whether there is one, as without descriptors.
bool MayRemove(const StoreHealth& health, const DataPaths& paths, FileSystem& files) {
  const auto may_be_locked = [](const auto& lock) {
    return lock.status().code() == absl::StatusCode::kAborted ||
           lock.status().code() == absl::StatusCode::kResourceExhausted;
  };
  return health.Check().ok() && !may_be_locked(files.Lock(paths.back_up_lock())) &&
         !may_be_locked(files.LockFolder(paths.files()));
}

// Whether it is not known, after this error, what is on the disk.
bool IsFailure(const absl::Status& status) {
  return status.code() == absl::StatusCode::kUnavailable || status.code() == absl::StatusCode::kDataLoss;
}

}  // namespace

uint64_t BallastBytesFor(const std::string& folder) {
  std::error_code error;
  std::filesystem::path path = std::filesystem::absolute(folder, error);
  while (!std::filesystem::exists(path, error) && path.has_relative_path()) {
    path = path.parent_path();
  }
  const std::filesystem::space_info space = std::filesystem::space(path, error);
  return error ? kMostBallast : std::min<uint64_t>(kMostBallast, space.capacity / kDiskPerBallast);
}

DurableLog::DurableLog(const DurableLogOptions& options, std::unique_ptr<DataFolder> folder,
                       std::unique_ptr<SessionTables> tables, std::unique_ptr<Folder> files_folder)
    : files_(*options.files),
      now_(options.now),
      max_mesh_chunk_bytes_(options.max_mesh_chunk_bytes),
      ballast_(std::make_shared<Ballast>(files_, folder->paths().ballast(), options.ballast_bytes)),
      health_(std::make_shared<StoreHealth>(options.on_failure, ballast_)),
      folder_(std::move(folder)),
      tables_(std::move(tables)),
      in_use_(std::make_shared<FilesInUse>(files_, [health = health_, paths = folder_->paths(),
                                                    files = &files_] { return MayRemove(*health, paths, *files); })),
      written_(std::make_shared<WrittenFiles>(std::move(files_folder), options.max_written_files)) {}

absl::StatusOr<std::unique_ptr<DurableLog>> DurableLog::Open(const DurableLogOptions& options) {
  HideFolder(options.folder);
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<DataFolder> folder, DataFolder::Open(options.folder, *options.files));
  SessionTablesOptions tables_options = options.tables;
  tables_options.files = options.files;
  if (options.ballast_bytes > 0) {
    const auto pages = static_cast<int>(options.ballast_bytes / kBallastPerLog / kPageBytes);
    tables_options.checkpoint_pages = std::min(tables_options.checkpoint_pages, std::max(pages, kLeastLogPages));
  }
  WELLSPACE_ASSIGN_OR_RETURN(tables_options.may_be_new, folder->FindDatabase());
  WELLSPACE_RETURN_IF_ERROR(CheckLog(*options.files, folder->paths().database()));
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<SessionTables> tables,
                             SessionTables::Open(folder->paths().database(), tables_options));
  // The names of the write-ahead log, and of its mark.
  WELLSPACE_RETURN_IF_ERROR(options.files->SynchronizeFolder(options.folder));
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<Folder> files_folder, options.files->OpenFolder(folder->paths().files()));
  std::unique_ptr<DurableLog> log(
      new DurableLog(options, std::move(folder), std::move(tables), std::move(files_folder)));
  log->ballast_->Fill().IgnoreError();  // without room for it what there is can be read and deleted
  return log;
}

absl::Status DurableLog::Commit(const SessionChange& change, Survives survives) {
  std::vector<std::string> files_of_deleted;
  if (change.is_deletion) {
    WELLSPACE_ASSIGN_OR_RETURN(const auto state, tables_->ReadState(change.session));
    if (state.has_value()) {
      files_of_deleted = FilesOf(folder_->paths(), *state);
      // There may be some that were not committed.
      files_of_deleted.push_back(folder_->paths().points(change.session, state->points_file()));
    }
  }
  WELLSPACE_RETURN_IF_ERROR(Enqueue(change, survives));
  for (const std::string& path : files_of_deleted) {
    in_use_->Remove(path);
  }
  return absl::OkStatus();
}

// Who is first in the queue commits all that wait, while others come and wait behind. Then the next one is first.
absl::Status DurableLog::Enqueue(const SessionChange& change, Survives survives) {
  Waiting waiting{.change = &change, .survives = survives, .bytes = BytesOf(change)};
  std::unique_lock lock(mutex_);
  queue_.push_back(&waiting);
  waiting.changed.wait(lock, [&] { return waiting.is_done || queue_.front() == &waiting; });
  if (waiting.is_done) {
    return waiting.status;
  }
  const std::vector<Waiting*> batch = TakeBatch();
  std::vector<AnswerKey> forgotten = std::exchange(forgotten_, {});
  lock.unlock();

  CommitBatch(batch, std::move(forgotten));

  lock.lock();
  for (Waiting* other : batch) {
    other->is_done = true;
    if (other != &waiting) {
      other->changed.notify_one();  // under the lock: it ends, with its condition variable, when the lock is free
    }
  }
  // All but the first leave the queue; that keeps the others waiting.
  queue_.erase(queue_.begin() + 1, queue_.begin() + static_cast<std::ptrdiff_t>(batch.size()));
  lock.unlock();

  if (const absl::Status checkpoint = tables_->Checkpoint(); IsFailure(checkpoint)) {
    health_->Fail(checkpoint).IgnoreError();  // what was committed stays so
  }

  lock.lock();
  queue_.pop_front();
  if (!queue_.empty()) {
    queue_.front()->changed.notify_one();
  }
  return waiting.status;
}

std::vector<DurableLog::Waiting*> DurableLog::TakeBatch() {
  std::vector<Waiting*> batch;
  uint64_t bytes = 0;
  for (Waiting* waiting : queue_) {
    bytes += waiting->bytes;
    if (batch.size() == kMaxBatch || (!batch.empty() && bytes > kMaxBatchBytes)) {
      break;
    }
    batch.push_back(waiting);
  }
  return batch;
}

void DurableLog::CommitBatch(std::span<Waiting* const> batch, std::vector<AnswerKey> forgotten) {
  const absl::Status status = Apply(batch, forgotten);
  for (Waiting* waiting : batch) {
    waiting->status = status;
  }
  if (status.ok() || IsFailure(status)) {
    return;
  }
  if (batch.size() > 1) {
    // One of them may be at fault: each for itself, then.
    for (Waiting* const& waiting : batch) {
      waiting->status = Apply({&waiting, 1}, forgotten);
      if (waiting->status.ok()) {
        forgotten.clear();
      }
    }
  }
  const std::lock_guard lock(mutex_);
  forgotten_.insert(forgotten_.begin(), forgotten.begin(), forgotten.end());
}

absl::Status DurableLog::Apply(std::span<Waiting* const> batch, std::span<const AnswerKey> forgotten) {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  std::vector<const SessionChange*> changes;
  bool survives_power_loss = false;
  for (const Waiting* waiting : batch) {
    changes.push_back(waiting->change);
    survives_power_loss |= waiting->survives == Survives::kPowerLoss;
  }
  const bool frees_room = std::ranges::all_of(changes, [](const SessionChange* change) { return change->is_deletion; });
  if (!frees_room) {
    WELLSPACE_RETURN_IF_ERROR(CheckRoom());
    // While the database has no room for the write-ahead log that there is, none comes behind it: what is kept for
    // deletions has to be enough to take it over.
    if (const absl::Status taken_over = tables_->Checkpoint(); !taken_over.ok()) {
      return IsFailure(taken_over) ? health_->Fail(taken_over) : taken_over;
    }
  }
  const absl::Status status = ApplyWithRoom(frees_room, [&] {
    return tables_->Apply(changes, forgotten, survives_power_loss ? Survives::kPowerLoss : Survives::kProcessDeath);
  });
  return IsFailure(status) ? health_->Fail(status) : status;
}

absl::Status DurableLog::CheckRoom() {
  absl::Status status = health_->CheckRoom();
  if (status.code() != absl::StatusCode::kResourceExhausted) {
    return status;
  }
  if (const absl::Status shrunk = tables_->Shrink(); IsFailure(shrunk)) {
    return health_->Fail(shrunk);
  }
  return health_->CheckRoom();
}

absl::Status DurableLog::ApplyWithRoom(bool frees_room, const std::function<absl::Status()>& apply) {
  absl::Status status = apply();
  if (status.code() != absl::StatusCode::kResourceExhausted) {
    return status;
  }
  // A write-ahead log that is in the database is written over, and takes no more room.
  if (absl::Status taken_over = tables_->CheckpointNow(); IsFailure(taken_over)) {
    return taken_over;
  }
  status = apply();
  if (status.code() != absl::StatusCode::kResourceExhausted || !frees_room || !ballast_->GiveUp()) {
    return status;
  }
  if (absl::Status taken_over = tables_->CheckpointNow(); IsFailure(taken_over)) {
    return taken_over;
  }
  return apply();
}

void DurableLog::Forget(std::span<const AnswerKey> answers) {
  const std::lock_guard lock(mutex_);
  forgotten_.insert(forgotten_.end(), answers.begin(), answers.end());
}

std::unique_ptr<PointStore> DurableLog::OpenPoints(const std::string& session, int dimension, uint64_t number,
                                                   std::vector<store::v1::StepRecord::Points> committed) {
  std::string path = folder_->paths().points(session, number);
  // A file that no change names yet is not garbage, and one whose session is deleted stays for those who still have it:
  // they are to find that the session is gone, and no damage.
  std::unique_ptr<FilesInUse::Use> use = in_use_->Take(path, /*is_written=*/committed.empty());
  return std::make_unique<PointFile>(files_, health_, written_, std::move(path), dimension, std::move(committed),
                                     std::move(use));
}

void DurableLog::DropPoints(const std::string& session, uint64_t number) {
  in_use_->Remove(folder_->paths().points(session, number));
}

absl::StatusOr<std::shared_ptr<MeshSnapshot>> DurableLog::KeepMesh(const std::string& session, uint64_t revision,
                                                                   core::Mesh mesh, const core::RunContext& context) {
  const std::string path = folder_->paths().mesh(session, revision);
  std::unique_ptr<FilesInUse::Use> use = in_use_->Take(path, /*is_written=*/true);
  // RemoveGarbage is to leave the file alone that has this name first, too.
  const std::unique_ptr<FilesInUse::Use> writing =
      in_use_->Take(path + std::string(kTemporaryEnd), /*is_written=*/true);
  WELLSPACE_ASSIGN_OR_RETURN(
      store::v1::MeshRecord record,
      WriteMeshFile(files_, written_->folder(), *health_, path, revision, mesh, context, max_mesh_chunk_bytes_));
  return std::make_shared<MeshFile>(files_, std::move(record), std::move(use), buffers_);
}

std::shared_ptr<MeshSnapshot> DurableLog::FindMesh(const std::string& session, const store::v1::SessionRecord& record) {
  if (!record.has_mesh()) {
    return nullptr;
  }
  const std::string path = folder_->paths().mesh(session, record.mesh().revision());
  return std::make_shared<MeshFile>(files_, record.mesh(), in_use_->Take(path, /*is_written=*/false), buffers_);
}

absl::StatusOr<Garbage> DurableLog::RemoveGarbage() {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  return folder_->RemoveGarbage(
      *in_use_, [this] { return tables_->ReadStates(); }, now_());
}

}  // namespace wellspace::server
