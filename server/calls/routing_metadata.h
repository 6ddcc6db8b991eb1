// Metadata of answers, by which proxies learn where sessions are: they do not read messages.
#ifndef WELLSPACE_SERVER_CALLS_ROUTING_METADATA_H_
#define WELLSPACE_SERVER_CALLS_ROUTING_METADATA_H_

namespace wellspace::server {

// The id of a session: of the answer of CreateSession, that of the session, which was made at this server; of a call
// that has ended with SESSION_ELSEWHERE, with kOwnerMetadata. Clients send it with each call on the session. Proxies
// are not to learn from what clients send: metadata and message need not be about one session.
inline constexpr char kSessionMetadata[] = "wellspace-session";
// Of a call that has ended with SESSION_ELSEWHERE: the address of the server that has the session.
inline constexpr char kOwnerMetadata[] = "wellspace-owner";

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_ROUTING_METADATA_H_
