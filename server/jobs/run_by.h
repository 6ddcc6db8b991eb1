// The threads that run the tasks given to Background, BlockingThreads and JobPool.
#ifndef WELLSPACE_SERVER_JOBS_RUN_BY_H_
#define WELLSPACE_SERVER_JOBS_RUN_BY_H_

namespace wellspace::server {

// kCaller is for tests that decide what runs when, in one thread: nothing runs but in their calls.
enum class RunBy { kOwnThreads, kCaller };

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_RUN_BY_H_
