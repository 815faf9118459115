"""Words in messages."""


def counted(number: int, noun: str, plural: str = "") -> str:
    """A number and what is counted: `1 block`, `2 blocks`; `plural` where that is not the noun with an s."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"
