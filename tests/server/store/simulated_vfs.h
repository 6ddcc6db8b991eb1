// The VFS by which SQLite reaches a simulated disk.
#ifndef WELLSPACE_TESTS_SERVER_STORE_SIMULATED_VFS_H_
#define WELLSPACE_TESTS_SERVER_STORE_SIMULATED_VFS_H_

#include <sqlite3.h>

#include <memory>
#include <string>

#include "tests/server/store/simulated_disk.h"

namespace wellspace::server {

// Does what SQLite's VFS for Unix does: which errors it makes of which causes; and that the first synchronisation of a
// journal or write-ahead log that it has made synchronises the folder, too. Without locks, and without shared memory.
struct SimulatedVfs {
  static void Register(SimulatedDisk& disk);

  // The struct that SQLite has memory for, one for each open file.
  struct OpenFile {
    sqlite3_file base;  // first, as SQLite wants it
    SimulatedDisk* disk;
    SimulatedDisk::Entry* inode;
    std::string* path;
    bool has_new_name;  // to be synchronised with the first synchronisation
    bool is_deleted_on_close;
  };

  static SimulatedDisk& DiskOf(sqlite3_vfs* vfs) { return *static_cast<SimulatedDisk*>(vfs->pAppData); }

  static int Open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags);
  static int Delete(sqlite3_vfs* vfs, const char* name, int synchronise_folder);
  static int Access(sqlite3_vfs* vfs, const char* name, int flags, int* out);
  static int FullPathname(sqlite3_vfs* vfs, const char* name, int size, char* out);

  static int Close(sqlite3_file* file);
  static int Read(sqlite3_file* file, void* into, int size, sqlite3_int64 offset);
  static int Write(sqlite3_file* file, const void* bytes, int size, sqlite3_int64 offset);
  static int Truncate(sqlite3_file* file, sqlite3_int64 size);
  static int Sync(sqlite3_file* file, int flags);
  static int FileSize(sqlite3_file* file, sqlite3_int64* size);
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_STORE_SIMULATED_VFS_H_
