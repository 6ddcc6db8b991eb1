// HTTP by hand: requests as of Prometheus, and malformed ones.
#ifndef WELLSPACE_TESTS_SERVER_HTTP_GET_H_
#define WELLSPACE_TESTS_SERVER_HTTP_GET_H_

#include <string>

namespace wellspace::server {

// A connection to `address`, "127.0.0.1:PORT", that has sent `bytes`. The descriptor is the caller's.
int SendHttp(const std::string& address, const std::string& bytes);

// The bytes that come on `socket` until the server closes it, or for a minute.
std::string ReadHttp(int socket);

// The whole response to GET `path`.
std::string HttpGet(const std::string& address, const std::string& path);

// The value of a series without labels in the answer to GET /metrics; -1 if there is none.
double MetricAt(const std::string& address, const std::string& name);

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_HTTP_GET_H_
