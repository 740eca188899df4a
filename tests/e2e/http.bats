# HTTP itself: methods, headers, negotiation, framing, operations.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() {
  cd "$BATS_TEST_TMPDIR" || return
  upload "$samples/cube.obj"
  cube=/v1/models/$id
}

# raw BYTES: sends them as they are (printf escapes), leaves what came back in the file answer, status in $status.
# A server that refuses may close before it has read them all.
raw() {
  local host port
  IFS=: read -r host port <<<"${url#http://}"
  printf '%b' "$1" >request
  exec 9<>"/dev/tcp/$host/$port"
  cat request >&9 || true
  timeout 5 cat <&9 >answer || true
  exec 9>&-
  status=$(sed -n '1s/^HTTP\/1.1 \([0-9]*\).*/\1/p' answer)
}

# alone: there was one answer on the connection, and it was closed.
alone() { [ "$(grep -ac '^HTTP/1.1 ' answer)" = 1 ]; }

# ---- operations ----------------------------------------------------------------------------------

@test "healthz, readyz and version" {
  for path in /healthz /readyz /version; do
    get "$path"
    expect 200
    http HEAD "$path"
    expect 200
  done
  get /version
  holds '.version | test("^[0-9]+\\.[0-9]+\\.[0-9]+")'
}

@test "metrics count the requests by route" {
  get "$cube"
  get /metrics
  expect 200
  [[ $(header content-type) == text/plain* ]]
  grep -qE '^tweend_[a-z_]+(\{.*\})? [0-9]' answer
  grep -F '/v1/models/{id}' answer
  if grep -F "$id" answer; then false; fi
}

@test "openapi.json describes every path that answers" {
  get /openapi.json
  expect 200
  [[ $(header content-type) == application/*json* ]]
  holds '.openapi | startswith("3.1")'
  for path in /v1/models '/v1/models/{id}' '/v1/models/{id}/source' '/v1/models/{id}/surface' \
    '/v1/models/{id}/pose' /v1/surface /v1/pose /healthz /readyz /version /openapi.json; do
    holds "[.paths | keys[] | sub(\"\\\\{[^}]*\\\\}\"; \"{id}\"; \"g\")] | any(startswith(\"$path\"))"
  done
}

# ---- methods -------------------------------------------------------------------------------------

@test "HEAD answers as GET does, without the body" {
  for path in /v1/models "$cube" "$cube/source" "$cube/surface.glb" "$cube/surface.json" /version; do
    get "$path"
    expect 200
    size=$(stat -c %s answer) type=$(header content-type) etag=$(header etag)
    http HEAD "$path"
    expect 200
    [ "$(header content-length)" = "$size" ]
    [ "$(header content-type)" = "$type" ]
    [ "$(header etag)" = "$etag" ]
  done
}

@test "answers are readable from other origins, errors too" {
  get "$cube" --header 'Origin: https://example.com'
  [ "$(header access-control-allow-origin)" = '*' ]
  get /nothing --header 'Origin: https://example.com'
  [ "$(header access-control-allow-origin)" = '*' ]
}

# ---- framing -------------------------------------------------------------------------------------

@test "a head that a reader could take in two ways is refused once, and nothing behind it is run" {
  local post='POST /v1/models HTTP/1.1\r\nHost: localhost\r\n' get='GET /version HTTP/1.1\r\nHost: localhost\r\n' head
  for head in "${post}Content-Length:\r\n 41\r\n" "${post}Content-Length:\r\n\t41\r\n" \
    "${post}Transfer-Encoding:\r\n chunked\r\n" "${get}X-A: b\r\n c\r\n" "${get}Accept:\r\n */*\r\n" \
    "${post}Content-Length: 3,3\r\n" "${post}Content-Length: +3\r\n" "${post}Content-Length: -1\r\n" \
    "${post}Content-Length: 3 3\r\n" "${post}Content-Length:\r\n" \
    "${post}Content-Length: 18446744073709551616\r\n" "${post}Content-Length: 3\0\r\n" \
    "${get}X-A: a\0b\r\n" "${get}X-A\0: a\r\n" 'GET /vers\0ion HTTP/1.1\r\nHost: localhost\r\n' \
    'GET /version HTTP/1.1\0\r\nHost: localhost\r\n' 'GET /version HTTP/1.1\r\nHost: x\0y\r\n'; do
    raw "$head"'\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n'
    # libmicrohttpd 1.0 hangs up on a zero byte in the target without a word.
    if [[ $head == 'GET /vers'* && ! -s answer ]]; then continue; fi
    [ "$status" = 400 ] || { echo "$head"; cat answer; return 1; }
    alone || { echo "$head"; cat answer; return 1; }
  done
}

@test "headers without end are refused" {
  raw "GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-Long: $(head -c 200000 /dev/zero | tr '\0' x)\r\n\r\n"
  [[ $status == 400 || $status == 431 || $status == 413 ]]
  get /healthz
  expect 200
}

@test "an expectation that is not known is refused" {
  post /v1/surface.json "$samples/cube.obj" --header 'Expect: rain'
  problem 417 100-continue
}

@test "two requests on one connection" {
  raw 'GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\nGET /version HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n'
  [ "$(grep -ac '^HTTP/1.1 200' answer)" = 2 ]
}

@test "a path has one resource, however it is encoded" {
  get "/v1/%6dodels/${cube#/v1/models/}/surface%2Ejson"
  expect 200
  get "/v1%2fmodels"
  problem 404
  get /metrics
  grep -qF '/v1/models/{id}/surface' answer
}

@test "fields on several lines are one list" {
  get "$cube" --header 'Accept: text/html' --header 'Accept: application/json'
  expect 200
  etag=$(header etag)
  get "$cube" --header 'If-None-Match: "other"' --header "If-None-Match: $etag"
  expect 304
  [[ -z $(header content-length) ]]
  get "$cube" --header 'If-Match: "other"' --header "If-Match: $etag"
  expect 200
  get /openapi.json --header 'Accept-Encoding: br' --header 'Accept-Encoding: zstd'
  [[ $(header content-encoding) == zstd ]]
}

@test "a client that ends its side after the request gets its answer" {
  IFS=: read -r host port <<<"${url#http://}"
  python3 - "$host" "$port" "$cube/surface.glb?level=6" >answer <<'END'
import socket, sys
s = socket.create_connection((sys.argv[1], int(sys.argv[2])), 20)
s.sendall(f"GET {sys.argv[3]} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
s.shutdown(socket.SHUT_WR)
while piece := s.recv(65536): sys.stdout.buffer.write(piece)
END
  head -1 answer | grep -q '^HTTP/1.1 200'
  length=$(sed -n 's/^Content-Length: \([0-9]*\).*/\1/p;/^\r$/q' answer)
  (($(stat -c %s answer) > length && length > 100000))
}

@test "texts come in the coding that is asked for, and unpack to the same" {
  upload "$samples/tank.json"
  for path in /openapi.json "/v1/models/$id/surface.obj?level=4" "/v1/models/$id/pose.csv?from=0&to=3&fps=300" \
    "/v1/models/$id/pose.json?from=0&to=3&fps=300"; do
    get "$path"
    mv answer plain
    [[ -z $(header content-encoding) ]]
    get "$path" --header 'Accept-Encoding: gzip, br'
    [[ $(header content-encoding) == gzip && $(header vary) == *Accept-Encoding* ]]
    gunzip <answer | cmp - plain
    get "$path" --header 'Accept-Encoding: gzip, br, zstd'
    [[ $(header content-encoding) == zstd ]]
    zstd --decompress --stdout --quiet <answer | cmp - plain
    http HEAD "$path" --header 'Accept-Encoding: gzip'
    [[ $(header content-encoding) == gzip ]]
  done
  get "/v1/models/$id/surface.glb" --header 'Accept-Encoding: gzip, br, zstd'
  [[ -z $(header content-encoding) && $(head -c 4 answer) == glTF ]]
}
