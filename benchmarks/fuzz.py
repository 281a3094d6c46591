"""Every reader on files and streams that a coverage-guided fuzzer makes of sound ones (atheris, libFuzzer).

    pip install -e '.[fuzz]'                             # Linux
    python -m benchmarks.fuzz                            # 20 s a reader
    python -m benchmarks.fuzz --seconds 600 PLY stream   # some of them, longer
    python -m benchmarks.fuzz --keep                     # what reaches other code goes to tests/data/fuzz.zip

A file has to be read, or refused with its three words; of a stream each byte has to be counted once. Whatever
else happens, and what takes more than 20 s or 2 GB, is kept in --found and told.
"""

from __future__ import annotations

import contextlib
import io
import os
import random
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path

from benchmarks.table import options_of

try:
    import atheris
except ImportError:
    sys.exit("atheris is missing: pip install -e '.[fuzz]' (it has wheels for Linux)")


STREAM = "stream"
# Of what is kept for the tests: so many for a reader, none longer than this in bytes.
MOST, LONGEST = 12, 4096


def readers():
    """The readers and the decoder, instrumented; slow, so once for all."""
    said = contextlib.redirect_stderr(io.StringIO())
    with said, atheris.instrument_imports(include=["mu_addon", "tomllib", "meshio"]):
        import meshio  # noqa: F401 - readers import it when they need it

        from mu_addon.sensing import decoder
        from tests.run import test_mutated_files
        from tests.sensing import mutations
    return test_mutated_files, mutations, decoder.Decoder


def fuzz(name, folder, options, files, streams, decoder_of):
    """Fuzz one reader in this process, with the corpus in `folder`; never returns."""
    work = Path(tempfile.mkdtemp(dir=folder.parent))
    if name != STREAM:
        file, _, reader = files.CORPUS[name]

    def read_file(data):
        (work / file).write_bytes(data)
        files.read_all(reader, work / file)

    def read_stream(data):
        # The first byte: in pieces of how many bytes the rest comes.
        size = 1 + 8 * data[0] if data else 1
        decoder, at = decoder_of(), 0.0
        for start in range(1, len(data), size):
            decoder.feed(data[start : start + size], at)
            at += 0.002
        decoder.finish(at)
        assert len(data[1:]) == decoder.counters.bytes == streams.accounted(decoder.counters)

    def mutate(data, longest, number):
        random_ = random.Random(number)
        if random_.random() < 0.5:
            return files.mutated(random_, data)[:longest]
        return atheris.Mutate(data, longest)

    common = ["-timeout=20", "-rss_limit_mb=2048", f"-max_len={5 * LONGEST}", "-print_final_stats=1"]
    common += [f"-artifact_prefix={folder.parent}/found-"]

    def run(data):
        try:
            (read_stream if name == STREAM else read_file)(data)
        except Exception:
            (folder.parent / "found-input").write_bytes(data)
            raise

    atheris.Setup([sys.argv[0], *common, *options, str(folder)], run, custom_mutator=mutate)
    atheris.Fuzz()


def fuzzed(name, folder, options, modules):
    """Fuzz one reader in a fork of this process; its exit status and what it wrote."""
    said = folder.parent / "said.txt"
    child = os.fork()
    if not child:
        with said.open("wb") as stream:
            os.dup2(stream.fileno(), 1)
            os.dup2(stream.fileno(), 2)
            try:
                fuzz(name, folder, options, *modules)
            finally:
                os._exit(1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said.read_text(errors="replace")


def sound(name, folder, files, streams):
    """Sound files of a reader, to begin with."""
    if name == STREAM:
        heads = [head + b"".join(map(sample, range(40))) for head, sample, _ in streams.FORMATS.values()]
        return [b"\x08" + head for head in heads] + [b"\x08" + line * 4 for line in streams.NASTY]
    return [files.CORPUS[name][1](folder), *files.fuzzed(name)]


def some(corpus):
    """Files of a corpus to keep: of the short ones some of every length."""
    short = sorted(
        (p for p in corpus.iterdir() if p.stat().st_size <= LONGEST), key=lambda p: p.stat().st_size
    )
    return [path.read_bytes() for path in short[:: max(1, -(-len(short) // MOST))]]


def keep(found, archived):
    """Put files by reader into the corpus of the tests, in the place of what was there of these."""
    with zipfile.ZipFile(archived) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    held = {name: data for name, data in held.items() if name.partition("/")[0] not in found}
    for name, contents in found.items():
        held |= {f"{name}/{number:02}": content for number, content in enumerate(contents)}
    beside = archived.with_suffix(".part")
    with zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(held.items()):
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    beside.replace(archived)


def main():
    parser = options_of(__doc__)
    parser.add_argument("readers", nargs="*", help="names as in tests/run/test_mutated_files.py, or stream")
    parser.add_argument("--seconds", type=int, default=20, help="for each reader")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--found", type=Path, default=Path("fuzz-found"), help="folder for what went wrong")
    parser.add_argument("--keep", action="store_true")
    given = parser.parse_args()
    modules = readers()
    files, streams, _ = modules
    kept, wrong = {}, 0
    for name in given.readers or [*files.CORPUS, STREAM]:
        with tempfile.TemporaryDirectory() as place:
            corpus = Path(place) / "corpus"
            corpus.mkdir()
            for number, content in enumerate(sound(name, Path(place), files, streams)):
                (corpus / f"sound-{number}").write_bytes(content)
            options = [f"-max_total_time={given.seconds}", f"-seed={given.seed}"]
            status, said = fuzzed(name, corpus, options, modules)
            runs = [line.split()[-1] for line in said.splitlines() if "executed_units" in line]
            words = f"{name}: {(runs or ['?'])[0]} runs, {len(list(corpus.iterdir()))} files in the corpus"
            print(f"{words}, {f'exit {status}' if status else 'as it should be'}", flush=True)
            if status:
                wrong += 1
                given.found.mkdir(parents=True, exist_ok=True)
                for path in Path(place).glob("found-*"):
                    shutil.copy(path, given.found / f"{name.replace(' ', '-')}-{path.name}")
                (given.found / f"{name.replace(' ', '-')}.txt").write_text(said[-8000:])
            if name != STREAM:
                kept[name] = some(corpus)
    if given.keep:
        keep(kept, files.FUZZED)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
