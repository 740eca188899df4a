# What the image is: small, without tools, not root, with a health check of its own.

image=${TWEEND_IMAGE:-tweend:test}

@test "it runs as a user that is not root" {
  user=$(docker image inspect --format '{{.Config.User}}' "$image")
  [[ -n $user && $user != root && $user != 0 && $user != 0:* ]]
}

@test "it holds no compiler and no headers" {
  run docker run --rm --entrypoint /bin/sh "$image" -c 'command -v cc gcc c++ g++ cmake ninja; ls /usr/include/microhttpd.h'
  [[ $output != */bin/* && $output != *"/usr/include/microhttpd.h"$'\n'* ]]
}

@test "every library that the program asks for is there" {
  run docker run --rm --read-only --cap-drop ALL "$image" --version
  [ "$status" -eq 0 ]
  [[ $output =~ [0-9]+\.[0-9]+\.[0-9]+ ]]
}

@test "its health check is the program's own, and says healthy" {
  [[ $(docker image inspect --format '{{json .Config.Healthcheck.Test}}' "$image") == *--healthcheck* ]]
  name=tweend-health-$$
  docker run --detach --name "$name" --read-only --cap-drop ALL --tmpfs /data:mode=1777 "$image" >/dev/null
  health=starting
  for _ in $(seq 60); do
    health=$(docker inspect --format '{{.State.Health.Status}}' "$name")
    [[ $health != starting ]] && break
    sleep 1
  done
  docker rm --force --volumes "$name" >/dev/null
  [ "$health" = healthy ]
}

@test "docker stop drains: it ends with status 0" {
  name=tweend-stop-$$
  docker run --detach --name "$name" --read-only --cap-drop ALL --tmpfs /data:mode=1777 "$image" >/dev/null
  sleep 1
  docker stop --time 10 "$name" >/dev/null
  status=$(docker inspect --format '{{.State.ExitCode}}' "$name")
  docker rm --force --volumes "$name" >/dev/null
  [ "$status" = 0 ]
}

@test "compose keeps the models in its named volume over a restart" {
  command -v docker-compose >/dev/null || skip "docker-compose is not installed"
  cd "$BATS_TEST_DIRNAME/../../docker"
  compose() { docker-compose --project-name "tweend-test-$$" "$@" >"$BATS_TEST_TMPDIR/compose.log" 2>&1; }
  port() { docker-compose --project-name "tweend-test-$$" port tweend 8080 | sed 's/.*://'; }
  ready() {
    for _ in $(seq 50); do curl --silent --fail --output /dev/null "http://127.0.0.1:$(port)/readyz" && return; sleep 0.2; done
    return 1
  }
  compose up --detach
  ready
  location=$(curl --silent --dump-header - --output /dev/null --data-binary @../server/samples/cube.obj \
    "http://127.0.0.1:$(port)/v1/models" | sed -n 's/^Location: *\(.*\)\r$/\1/Ip')
  compose down
  compose up --detach
  ready
  run curl --silent --fail --output /dev/null "http://127.0.0.1:$(port)$location"
  compose down --volumes
  [ "$status" -eq 0 ]
}
