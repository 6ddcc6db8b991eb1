// Metadata of answers, by which proxies learn where sessions are: they do not read messages.
#ifndef WELLSPACE_SERVER_CALLS_ROUTING_METADATA_H_
#define WELLSPACE_SERVER_CALLS_ROUTING_METADATA_H_

namespace wellspace::server {

// Of the answer of CreateSession: the id of the session, which is at this server. Clients send it with each call on it.
inline constexpr char kSessionMetadata[] = "wellspace-session";
// Of a call that has ended with SESSION_ELSEWHERE: the address of the server that has the session.
inline constexpr char kOwnerMetadata[] = "wellspace-owner";

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_ROUTING_METADATA_H_
