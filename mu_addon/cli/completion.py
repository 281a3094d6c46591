"""Completion of commands, options and choices in bash: a script that is made from the parser."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Iterator

SHELLS = ("bash",)
_SCRIPT = r"""# Completion of run.py in bash: eval "$(python headless/run.py --completion bash)"
_mu_addon() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} at=0 n words=
  COMPREPLY=()
  for ((n = 0; n < COMP_CWORD; n++)); do
    if [[ ${{COMP_WORDS[n]}} == *run.py ]]; then at=$((n + 1)); break; fi
  done
  # Another program of Python.
  ((at)) || return
  if ((COMP_CWORD == at)); then
    words={commands}
  else
    case "${{COMP_WORDS[at]}} $before" in
{choices}
      *) if [[ $current == -* ]]; then
        case ${{COMP_WORDS[at]}} in
{options}
        esac
      fi ;;
    esac
  fi
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o bashdefault -o default -F _mu_addon run.py python python3
"""


def script(parser: argparse.ArgumentParser) -> str:
    """The script for bash; it completes file names where there are no fixed choices."""
    from ..design.gripper import gripper_names
    from ..design.parameters import preset_names

    presets = {"grip": gripper_names()}
    choices, options = [], []
    for name, command in _commands(parser):
        flags: list[str] = []
        for action in command._actions:
            flags += action.option_strings
            given = [*map(str, action.choices or ())]
            if "--preset" in action.option_strings:
                given = [*presets.get(name, preset_names())]
            known = action.option_strings if given else ()
            choices += [f'      "{name} {flag}") words={_quoted(given)} ;;' for flag in known]
        options.append(f"          {name}) words={_quoted(flags)} ;;")
    names = [name for name, _ in _commands(parser)]
    top = [flag for action in parser._actions for flag in action.option_strings]
    return _SCRIPT.format(
        commands=_quoted([*names, *top]), choices="\n".join(choices), options="\n".join(options)
    )


def _quoted(words: list[str]) -> str:
    return shlex.quote(" ".join(words))


def _commands(parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield from action.choices.items()


class Complete(argparse.Action):
    """Print the script of a shell, and end."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        """Print the script."""
        sys.stdout.write(script(parser))
        parser.exit(0)
