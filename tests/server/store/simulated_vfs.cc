#include "tests/server/store/simulated_vfs.h"

#include <algorithm>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace wellspace::server {
namespace {

SimulatedVfs::OpenFile& Of(sqlite3_file* file) { return *reinterpret_cast<SimulatedVfs::OpenFile*>(file); }

std::string FolderOf(const std::string& path) { return path.substr(0, path.rfind('/')); }

bool IsFull(const absl::Status& status) { return status.code() == absl::StatusCode::kResourceExhausted; }

int NoLock(sqlite3_file* /*file*/, int /*level*/) { return SQLITE_OK; }
int NoReservedLock(sqlite3_file* /*file*/, int* out) {
  *out = 0;
  return SQLITE_OK;
}
int NoControl(sqlite3_file* /*file*/, int /*operation*/, void* /*argument*/) { return SQLITE_NOTFOUND; }
int SectorSize(sqlite3_file* /*file*/) { return 4096; }
// As SQLite takes it of the file systems of Unix.
int Characteristics(sqlite3_file* /*file*/) { return SQLITE_IOCAP_POWERSAFE_OVERWRITE; }

const sqlite3_io_methods& Methods() {
  static const sqlite3_io_methods methods = [] {
    sqlite3_io_methods m{};
    m.iVersion = 1;
    m.xClose = &SimulatedVfs::Close;
    m.xRead = &SimulatedVfs::Read;
    m.xWrite = &SimulatedVfs::Write;
    m.xTruncate = &SimulatedVfs::Truncate;
    m.xSync = &SimulatedVfs::Sync;
    m.xFileSize = &SimulatedVfs::FileSize;
    m.xLock = &NoLock;
    m.xUnlock = &NoLock;
    m.xCheckReservedLock = &NoReservedLock;
    m.xFileControl = &NoControl;
    m.xSectorSize = &SectorSize;
    m.xDeviceCharacteristics = &Characteristics;
    return m;
  }();
  return methods;
}

int Randomness(sqlite3_vfs* /*vfs*/, int size, char* out) {
  // Salts of write-ahead logs: other ones each time, and the same ones in each run.
  static thread_local uint64_t state = 1;
  for (int i = 0; i < size; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    out[i] = static_cast<char>(state >> 56);
  }
  return size;
}
int Sleep(sqlite3_vfs* /*vfs*/, int microseconds) { return microseconds; }
int CurrentTime(sqlite3_vfs* /*vfs*/, double* out) {
  *out = 2'461'000.5;
  return SQLITE_OK;
}
int LastError(sqlite3_vfs* /*vfs*/, int /*size*/, char* /*out*/) { return 0; }

}  // namespace

void SimulatedVfs::Register(SimulatedDisk& disk) {
  sqlite3_vfs& vfs = disk.vfs_;
  vfs.iVersion = 1;
  vfs.szOsFile = sizeof(OpenFile);
  vfs.mxPathname = 512;
  vfs.zName = disk.vfs_name_.c_str();
  vfs.pAppData = &disk;
  vfs.xOpen = &Open;
  vfs.xDelete = &Delete;
  vfs.xAccess = &Access;
  vfs.xFullPathname = &FullPathname;
  vfs.xRandomness = &Randomness;
  vfs.xSleep = &Sleep;
  vfs.xCurrentTime = &CurrentTime;
  vfs.xGetLastError = &LastError;
  sqlite3_vfs_register(&vfs, 0);
}

int SimulatedVfs::Open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  OpenFile& open = Of(file);
  std::memset(static_cast<void*>(&open), 0, sizeof(open));
  SimulatedDisk& disk = DiskOf(vfs);
  if (name == nullptr) {
    return SQLITE_CANTOPEN;  // a temporary file, of which there are to be none
  }
  const bool is_there = disk.Has(name);
  const auto mode = (flags & SQLITE_OPEN_CREATE) != 0
                        ? FileSystem::Mode::kCreateOrWrite
                        : ((flags & SQLITE_OPEN_READONLY) != 0 ? FileSystem::Mode::kRead : FileSystem::Mode::kWrite);
  auto inode = disk.Open(name, mode);
  if (!inode.ok()) {
    return SQLITE_CANTOPEN;
  }
  open.base.pMethods = &Methods();
  open.disk = &disk;
  open.inode = new SimulatedDisk::Entry(*std::move(inode));
  open.path = new std::string(name);
  open.has_new_name = !is_there && (flags & (SQLITE_OPEN_MAIN_JOURNAL | SQLITE_OPEN_WAL)) != 0;
  open.is_deleted_on_close = (flags & SQLITE_OPEN_DELETEONCLOSE) != 0;
  if (out_flags != nullptr) {
    *out_flags = flags;
  }
  return SQLITE_OK;
}

int SimulatedVfs::Delete(sqlite3_vfs* vfs, const char* name, int synchronise_folder) {
  SimulatedDisk& disk = DiskOf(vfs);
  if (const absl::Status removed = disk.Remove(name); !removed.ok()) {
    return removed.code() == absl::StatusCode::kNotFound ? SQLITE_IOERR_DELETE_NOENT : SQLITE_IOERR_DELETE;
  }
  if ((synchronise_folder & 1) != 0 && !disk.SynchronizeFolder(FolderOf(name)).ok()) {
    return SQLITE_IOERR_DIR_FSYNC;
  }
  return SQLITE_OK;
}

int SimulatedVfs::Access(sqlite3_vfs* vfs, const char* name, int /*flags*/, int* out) {
  *out = DiskOf(vfs).Has(name) ? 1 : 0;
  return SQLITE_OK;
}

int SimulatedVfs::FullPathname(sqlite3_vfs* /*vfs*/, const char* name, int size, char* out) {
  sqlite3_snprintf(size, out, "%s", name);
  return SQLITE_OK;
}

int SimulatedVfs::Close(sqlite3_file* file) {
  OpenFile& open = Of(file);
  if (open.is_deleted_on_close) {
    open.disk->Remove(*open.path).IgnoreError();
  }
  delete open.inode;
  delete open.path;
  return SQLITE_OK;
}

int SimulatedVfs::Read(sqlite3_file* file, void* into, int size, sqlite3_int64 offset) {
  OpenFile& open = Of(file);
  if (!open.disk->Begin("read", *open.path, /*is_read=*/true).ok()) {
    return SQLITE_IOERR_READ;
  }
  const std::string& content = (*open.inode)->content;
  const auto start = std::min<uint64_t>(offset, content.size());
  const size_t count = content.copy(static_cast<char*>(into), size, start);
  std::memset(static_cast<char*>(into) + count, 0, size - count);
  return count == static_cast<size_t>(size) ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
}

int SimulatedVfs::Write(sqlite3_file* file, const void* bytes, int size, sqlite3_int64 offset) {
  OpenFile& open = Of(file);
  const absl::Status written =
      open.disk->Write(**open.inode, *open.path, offset, {static_cast<const char*>(bytes), static_cast<size_t>(size)});
  return written.ok() ? SQLITE_OK : (IsFull(written) ? SQLITE_FULL : SQLITE_IOERR_WRITE);
}

int SimulatedVfs::Truncate(sqlite3_file* file, sqlite3_int64 size) {
  OpenFile& open = Of(file);
  return open.disk->Truncate(**open.inode, *open.path, size).ok() ? SQLITE_OK : SQLITE_IOERR_TRUNCATE;
}

int SimulatedVfs::Sync(sqlite3_file* file, int /*flags*/) {
  OpenFile& open = Of(file);
  if (!open.disk->Synchronize(**open.inode, *open.path).ok()) {
    return SQLITE_IOERR_FSYNC;
  }
  if (open.has_new_name) {
    open.disk->SynchronizeFolder(FolderOf(*open.path)).IgnoreError();  // as SQLite does
    open.has_new_name = false;
  }
  return SQLITE_OK;
}

int SimulatedVfs::FileSize(sqlite3_file* file, sqlite3_int64* size) {
  *size = static_cast<sqlite3_int64>((*Of(file).inode)->content.size());
  return SQLITE_OK;
}

}  // namespace wellspace::server
