// HTTP/2 by hand (RFC 9113), right or wrong on purpose.
#ifndef WELLSPACE_TESTS_SERVER_RAW_HTTP2_H_
#define WELLSPACE_TESTS_SERVER_RAW_HTTP2_H_

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "absl/time/time.h"

namespace wellspace::server {

struct Frame {
  enum Type : uint8_t {
    kData = 0,
    kHeaders = 1,
    kPriority = 2,
    kRstStream = 3,
    kSettings = 4,
    kPushPromise = 5,
    kPing = 6,
    kGoaway = 7,
    kWindowUpdate = 8,
    kContinuation = 9,
  };
  static constexpr uint8_t kEndStream = 1;
  static constexpr uint8_t kAck = 1;
  static constexpr uint8_t kEndHeaders = 4;

  uint8_t type = 0;
  uint8_t flags = 0;
  uint32_t stream = 0;
  std::string payload = "";

  std::string Serialize() const;
};

// The first bytes of a connection: the preface, and empty settings.
std::string ConnectionStart();

// `value` in four bytes, as HTTP/2 writes numbers.
std::string BigEndian(uint32_t value);

// One header in HPACK, literal and not indexed. REQUIRES: less than 2^14 bytes each.
std::string Header(std::string_view name, std::string_view value);

// The headers of a call of `path`, "/package.Service/Method".
std::string CallHeaders(std::string_view path);

// The frames with which a call begins, and with which it is given up.
Frame BeginCall(uint32_t stream, std::string_view path);
Frame ResetCall(uint32_t stream);

// A message as gRPC frames it; `length` and `flag` may lie.
std::string GrpcMessage(std::string_view bytes, std::optional<uint32_t> length = std::nullopt, uint8_t flag = 0);

// A connection to a server on this machine, in plain text.
//
// Thread safety: thread-compatible.
class RawConnection {
 public:
  // `address` is "127.0.0.1:PORT".
  explicit RawConnection(const std::string& address);
  ~RawConnection();
  RawConnection(RawConnection&& other) noexcept;
  RawConnection& operator=(RawConnection&&) = delete;

  // False when the server has closed the connection, or is stuck.
  bool Send(std::string_view bytes);
  bool Send(const Frame& frame) { return Send(frame.Serialize()); }

  // Begins as HTTP/2 has it: preface, settings, and the server's settings acknowledged, without which gRPC takes none
  // of its limits for agreed upon. False when the server has closed the connection.
  bool Begin();

  // Whether the server took nothing of the last bytes sent for as long as the peer has patience.
  bool is_stuck() const { return is_stuck_; }
  // A minute at first.
  void SetPatience(int seconds);

  // Throws away all bytes that have come.
  void Discard();

  // The next frame. None when the server has closed the connection, or sends nothing for a minute: the test has failed.
  std::optional<Frame> Read();
  // The next frame of `type`; those between are left out.
  std::optional<Frame> ReadUntil(uint8_t type);

  // Begins the connection and on it a call of `path`, and sends one message that says it has `length` bytes, as fast as
  // the windows of HTTP/2 allow. Ends when the server ends the call or the connection, or when all has been sent.
  // Returns how many bytes were sent.
  uint64_t SendMessageUntilRefused(std::string_view path, uint32_t length);

  // Reads until the server closes the connection. False when it sends nothing for a minute instead.
  bool IsClosedByServer();

  // Whether the server answers a ping on this connection. REQUIRES: it has been begun.
  bool IsAlive();

  // Reads to the end of the call on `stream`. Its status, -1 when the server gave up the call or the connection without
  // one.
  // REQUIRES: it is the first of the connection to have one, so that its trailers stand there literally.
  int ReadStatus(uint32_t stream);

 private:
  // `size` bytes; fewer at the end.
  std::string ReadBytes(size_t size);

  int socket_;
  bool is_stuck_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_RAW_HTTP2_H_
