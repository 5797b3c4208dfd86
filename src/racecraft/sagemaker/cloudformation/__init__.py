"""CloudFormation templates, read without AWS: nothing in them is run."""
