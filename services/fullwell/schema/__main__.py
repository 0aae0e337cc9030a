"""``python -m fullwell.schema > docs/recipe-v1.schema.json`` writes the JSON schema of recipes, for editors."""

import json

from fullwell.schema.v1.recipe import json_schema

if __name__ == "__main__":
    print(json.dumps(json_schema(), indent=1, sort_keys=True))
