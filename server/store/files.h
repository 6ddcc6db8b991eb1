// The points and meshes of sessions: data that is too large for records, which name it.
#ifndef WELLSPACE_SERVER_STORE_FILES_H_
#define WELLSPACE_SERVER_STORE_FILES_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/mesh/mesh.h"
#include "server/store/mesh_snapshot.h"
#include "server/store/point_store.h"
#include "server/store/records.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// Files that no record names, and that no owner may still have named.
struct Garbage {
  struct SetAside {
    std::string from;
    std::string to;
  };
  std::vector<SetAside> set_aside;   // paths; kept for a day, should they be missed
  std::vector<std::string> removed;  // paths; set aside a day ago or longer
  std::vector<std::string> unknown;  // paths; not ours, and left where they are
};

// The points of a session, as they are opened.
struct SessionPoints {
  std::string session;
  int dimension = 0;
  std::vector<store::v1::PointsFile> files{};              // where those that there are lie
  std::vector<store::v1::StepRecord::Points> committed{};  // of the steps that have brought them
  store::v1::PointsFile next{};  // where more come: the last of `files`, or one behind it, of this owner's epoch
};

// Points and meshes, as files or in memory. Nothing of them belongs to a session before a record names it. Names have
// the epoch of the owner that writes, so that several processes can share the files: none writes, or removes, a file
// that another may have named.
//
// Thread safety: thread-safe.
class Files {
 public:
  virtual ~Files() = default;

  // Points that are appended to a new file end with the process, until a change names it.
  virtual std::unique_ptr<PointStore> OpenPoints(SessionPoints points) = 0;

  // Removes a points file that `session` has no more, or that it has not come to have.
  virtual void DropPoints(const std::string& session, const store::v1::PointsFile& file) = 0;

  // Keeps `mesh` as that of `revision`, made by the owner at `epoch`: when it returns, the written file outlives a
  // loss of power. Until a change names it (SessionRecord.mesh) it ends with the process all the same.
  //
  // Errors:     DISK_FULL, STORE_FAILED; CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(const std::string& session, uint64_t revision,
                                                                 uint64_t epoch, core::Mesh mesh,
                                                                 const core::RunContext& context) = 0;

  // The mesh that `record` names; null: none. Its file is looked at when something of it is asked for.
  virtual std::shared_ptr<MeshSnapshot> FindMesh(const store::v1::SessionRecord& record) = 0;

  // Removes all files that `deleted` names, the record of a session that is no more.
  virtual void RemoveAll(const store::v1::SessionRecord& deleted) = 0;

  // Sets files aside that no record names, and removes those that were set aside a day ago. Files of this process's
  // epochs are left alone while it has them, those of others unless their owners are no more (Census.oldest_epoch).
  // The first call removes nothing.
  //
  // Errors:     those of `read`; STORE_FAILED.
  using ReadCensus = std::function<absl::StatusOr<Census>()>;
  virtual absl::StatusOr<Garbage> RemoveGarbage(const ReadCensus& read) = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_FILES_H_
