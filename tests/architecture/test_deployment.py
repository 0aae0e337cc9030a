"""Images, Compose file and cluster manifests keep their promises; nothing here needs an engine or a cluster."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
DOCKERFILES = sorted([*ROOT.glob("*/Dockerfile"), *ROOT.glob("*/*.Dockerfile")])
BASE = ROOT / "k8s" / "base"
AUTOSCALING = ROOT / "k8s" / "overlays" / "autoscaling"
MANIFESTS = sorted(path for path in BASE.glob("*.yaml") if path.name != "kustomization.yaml")


def _name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def _documents(*paths: Path) -> list[dict[str, Any]]:
    return [document for path in paths for document in yaml.safe_load_all(path.read_text()) if document]


def _workloads() -> list[dict[str, Any]]:
    return [document for document in _documents(*MANIFESTS) if document["kind"] in ("Deployment", "StatefulSet")]


def _label(document: dict[str, Any]) -> str:
    return f"{document['kind']}/{document['metadata']['name']}"


def _compose() -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
    return document


@pytest.mark.parametrize("path", DOCKERFILES, ids=_name)
def test_images_have_stages_run_without_root_and_tell_their_health(path: Path) -> None:
    text = path.read_text()
    assert len(re.findall(r"^FROM ", text, re.MULTILINE)) >= 2
    final = text[text.rindex("\nFROM ") :]
    users = re.findall(r"^USER (\S+)", final, re.MULTILINE)
    assert users, "the final stage has no USER"
    assert users[-1].split(":")[0] not in ("root", "0")
    health = re.search(r"^HEALTHCHECK .*?(?<!\\)\n", final, re.MULTILINE | re.DOTALL)
    assert health, "the final stage has no HEALTHCHECK"
    assert "NONE" not in health[0]


@pytest.mark.parametrize("path", [path for path in DOCKERFILES if path.parent.name != "k8s"], ids=_name)
def test_python_images_install_the_tested_versions(path: Path) -> None:
    installs = [line for line in path.read_text().splitlines() if " install " in line and "pip " in line]
    assert installs
    assert all("PIP_CONSTRAINT=/src/constraints/constraints.txt" in line for line in installs)


@pytest.mark.parametrize("service", sorted(_compose()["services"]))
def test_every_service_of_the_compose_file_tells_its_health_and_waits_for_healthy_ones(service: str) -> None:
    definition = _compose()["services"][service]
    assert definition["healthcheck"]["test"]
    for other, condition in definition.get("depends_on", {}).items():
        assert condition == {"condition": "service_healthy"}, other


def test_secrets_of_the_compose_file_have_no_default_and_are_in_the_example() -> None:
    text = (ROOT / "docker-compose.yml").read_text()
    example = (ROOT / ".env.example").read_text()
    secret = r"(?:PASSWORD|SECRET_KEY|ACCESS_KEY|API_KEYS|CURATOR_KEYS)"
    for name in set(re.findall(rf"(?<!\$)\$\{{(\w*{secret})\b", text)):
        assert re.search(rf"\$\{{{name}:\?", text), f"{name} may be left out"
        assert not re.search(rf"\$\{{{name}:?-", text), f"{name} has a default"
        assert re.search(rf"^{name}=$", example, re.MULTILINE), f"{name} is not in .env.example, or has a value there"


def test_the_compose_file_publishes_ports_on_this_machine_only() -> None:
    for definition in _compose()["services"].values():
        assert all(str(port).startswith("127.0.0.1:") for port in definition.get("ports", []))


@pytest.mark.parametrize("document", _documents(*MANIFESTS), ids=_label)
def test_manifests_fit_the_published_schemas(document: dict[str, Any]) -> None:
    validator = pytest.importorskip("kubernetes_validate")
    validator.validate(document, "1.31", strict=True)


@pytest.mark.parametrize("document", _workloads(), ids=_label)
def test_containers_are_probed_bounded_and_unprivileged(document: dict[str, Any]) -> None:
    pod = document["spec"]["template"]["spec"]
    assert pod["securityContext"]["runAsNonRoot"] is True
    assert pod["terminationGracePeriodSeconds"] >= 30
    assert pod["automountServiceAccountToken"] is False
    for container in pod["containers"]:
        assert {"startupProbe", "livenessProbe", "readinessProbe"} <= set(container)
        assert {"cpu", "memory"} <= set(container["resources"]["requests"])
        assert "memory" in container["resources"]["limits"]
        security = container["securityContext"]
        assert security["allowPrivilegeEscalation"] is False
        assert security["readOnlyRootFilesystem"] is True
        assert security["capabilities"] == {"drop": ["ALL"]}


def test_manifests_hold_no_secret_values() -> None:
    assert [_label(document) for document in _documents(*MANIFESTS) if document["kind"] == "Secret"] == []
    for workload in _workloads():
        for container in workload["spec"]["template"]["spec"]["containers"]:
            for variable in container.get("env", []):
                if re.search(r"PASSWORD|SECRET|ACCESS_KEY|API_KEYS|CURATOR_KEYS", variable["name"]):
                    assert "secretKeyRef" in variable.get("valueFrom", {}), variable["name"]


def test_a_worker_pod_outlives_its_longest_frame() -> None:
    kustomization = _documents(BASE / "kustomization.yaml")[0]
    settings = dict(literal.split("=", 1) for literal in kustomization["configMapGenerator"][0]["literals"])
    worker = next(document for document in _workloads() if document["metadata"]["name"] == "fullwell-worker")
    grace_s = worker["spec"]["template"]["spec"]["terminationGracePeriodSeconds"]
    assert int(settings["FULLWELL_FRAME_TIME_LIMIT_S"]) <= int(settings["FULLWELL_SOFT_SHUTDOWN_S"]) < grace_s
    limit = worker["spec"]["template"]["spec"]["containers"][0]["resources"]["limits"]["memory"]
    assert int(settings["FULLWELL_MAX_MEMORY_PER_CHILD_MIB"]) < int(limit.removesuffix("Gi")) * 1024


def test_workers_are_scaled_on_queued_and_running_frames_and_ingestions() -> None:
    scaled = _documents(AUTOSCALING / "scaledobject.yaml")[0]
    triggers = {trigger["name"]: trigger for trigger in scaled["spec"]["triggers"]}
    assert all(trigger["type"] == "metrics-api" for trigger in triggers.values()), "the broker's lists hold nothing that runs"
    assert {name: trigger["metadata"]["valueLocation"] for name, trigger in triggers.items()} == {
        "queued": 'fullwell_frames{state="queued"}',
        "running": 'fullwell_frames{state="running"}',
        "ingestions_queued": 'fullwell_ingestions{state="queued"}',
        "ingestions_running": 'fullwell_ingestions{state="running"}',
    }
    assert set(scaled["spec"]["advanced"]["scalingModifiers"]["formula"].split(" + ")) == set(triggers)


@pytest.mark.parametrize("folder", [BASE, AUTOSCALING], ids=_name)
def test_kustomize_builds(folder: Path) -> None:
    kubectl = shutil.which("kubectl")
    if kubectl is None:
        pytest.skip("kubectl is not installed")
    built = subprocess.run([kubectl, "kustomize", str(folder)], capture_output=True, text=True, timeout=60, check=False)
    assert built.returncode == 0, built.stderr
    names = {document["metadata"]["name"] for document in yaml.safe_load_all(built.stdout) if document}
    assert {"fullwell-api", "fullwell-worker", "fullwell-store"} <= names
