# What the image is: small, without tools, not root, with a health check of its own.

image=${TWEEND_IMAGE:-tweend:test}

@test "it runs as a user that is not root" {
  user=$(docker image inspect --format '{{.Config.User}}' "$image")
  [[ -n $user && $user != root && $user != 0 && $user != 0:* ]]
}

@test "it holds the program and its libraries, and no shell, compiler, header or package manager" {
  name=tweend-files-$$
  docker create --name "$name" "$image" >/dev/null
  docker export "$name" | tar t >"$BATS_TEST_TMPDIR/files"
  docker rm --volumes "$name" >/dev/null
  grep -qx 'usr/bin/tweend' "$BATS_TEST_TMPDIR/files"
  run grep -E '(^|/)(sh|bash|cc|gcc|g\+\+|cmake|apt|dpkg)$|\.h$' "$BATS_TEST_TMPDIR/files"
  echo "$output"
  [ "$status" -eq 1 ]
}

@test "every library that the program asks for is there" {
  run docker run --rm --read-only --cap-drop ALL "$image" --version
  [ "$status" -eq 0 ]
  [[ $output =~ [0-9]+\.[0-9]+\.[0-9]+ ]]
}

@test "its health check is the program's own, and says healthy" {
  [[ $(docker image inspect --format '{{json .Config.Healthcheck.Test}}' "$image") == *--healthcheck* ]]
  name=tweend-health-$$
  docker run --detach --name "$name" --read-only --cap-drop ALL --volume /data "$image" >/dev/null
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
  docker run --detach --name "$name" --read-only --cap-drop ALL --volume /data "$image" >/dev/null
  sleep 1
  docker stop --time 10 "$name" >/dev/null
  status=$(docker inspect --format '{{.State.ExitCode}}' "$name")
  docker rm --force --volumes "$name" >/dev/null
  [ "$status" = 0 ]
}

@test "compose keeps the models in its named volume over a restart" {
  command -v docker-compose >/dev/null || skip "docker-compose is not installed"
  url=http://127.0.0.1:8080
  if curl --silent --output /dev/null "$url"; then skip "something else has port 8080"; fi
  compose() { docker-compose --project-name "tweend-test-$$" --file "$BATS_TEST_DIRNAME/../../docker/compose.yaml" "$@"; }
  ready() {
    for _ in $(seq 50); do
      curl --silent --fail --output /dev/null "$url/readyz" && return
      sleep 0.2
    done
    return 1
  }
  compose up --detach
  ready
  location=$(curl --silent --dump-header - --output /dev/null \
    --data-binary "@$BATS_TEST_DIRNAME/../../server/samples/cube.obj" "$url/v1/models" | sed -n 's/^Location: *\(.*\)\r$/\1/Ip')
  compose down
  compose up --detach
  ready
  run curl --silent --fail --output /dev/null "$url$location"
  compose down --volumes --rmi all
  [ "$status" -eq 0 ]
}
